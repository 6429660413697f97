"""The router between the two networks of docker/compose.yaml: `python -m feelahead.containers.router`.

It passes what arrives at its ports 5555 and 5556 from the operator's network on to the robot side, under its own
address, so that neither side needs a route or a right of its own; and it applies the link, one netem for each
direction, to what leaves it. Where the kernel has no netem, a User-Mode Linux that has it routes in its place. Where
that cannot be, or the link asks for more than netem can do, the sides emulate the link themselves: they wait for the
file `--said`, which has what they are to emulate. Which of the three it is, is said aloud.

Containers come and go, and so do addresses and interfaces: it looks twice a second, and sets up anew what changed.
"""

import json
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import tyro

from common.clock import MonotonicClock
from common.command.command_line import parse_settings, run_command
from common.command.stop_signal import StopSignal
from common.emulation.spec import Direction, LinkSpec
from common.files.output_file import output_file, write_json
from feelahead.containers import guest
from feelahead.containers.cable import Cable, delays, find_cable
from feelahead.containers.netem import BeyondNetemError, count_packets, netem_words
from feelahead.containers.system import CommandFailedError, run_system

PROGRAM = "feelahead-router"
_PERIOD_S: Final = 0.5
_AWAY: Final = ("tc", "qdisc", "del", "dev", "lo", "root")
_COUNT: Final = ("tc", "-statistics", "-json", "qdisc", "show")
_MOST_FAILED: Final = 10
"""Looks in a row."""
_GUEST_LIMIT_S: Final = 60.0
"""It boots in two seconds, and on a very busy machine in forty."""


@dataclass(frozen=True)
class RouterSettings:
    """Pass the robot side's ports on from one network to another, over a link that netem emulates."""

    link: Annotated[str, tyro.conf.arg(metavar="NAME|SPEC")] = ""
    """The link, by name or in netem's words, as for feelahead-robot."""
    robot: Annotated[str, tyro.conf.arg(metavar="HOST")] = "robot-side"
    """The robot side's name or address in its own network."""
    said: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("/link/emulated")
    """Where to write what the sides have to emulate themselves: nothing, or the link."""
    packets: Annotated[Path, tyro.conf.arg(metavar="FILE.json")] = Path("/link/packets.json")
    """Where to write what netem has passed on and dropped in each direction, when --count asks for it."""
    count: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("/link/count")
    """Whoever makes this file asks for it; it goes when it is answered."""
    guest: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("/run/feelahead")
    """For User-Mode Linux; on a file system that lets programs run."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        LinkSpec.parse(self.link)


def command(arguments: Sequence[str]) -> int:
    """Route until SIGTERM; an error where the network may not be changed."""
    settings = parse_settings(RouterSettings, PROGRAM, arguments)
    router, clock, failed = Router(settings), MonotonicClock(), 0
    with StopSignal() as stop:
        try:
            while not stop.is_set:
                try:
                    router.look(clock.now())
                    failed = 0
                except CommandFailedError as error:
                    # As when a network goes in the middle of it.
                    failed += 1
                    _say(str(error))
                    if failed == _MOST_FAILED:
                        raise
                time.sleep(_PERIOD_S)
        finally:
            router.guest.stop()
    return 0


class Router:
    """What is set up at the moment, and what has to be."""

    def __init__(self, settings: RouterSettings) -> None:
        self._settings = settings
        self._cable: Cable | None = None
        self._told = self._asked = False
        self._applied_s = 0.0
        self.guest = guest.Guest(settings.guest)
        self._words: Mapping[Direction, str] | None = None
        self._apply: Callable[[Cable], None] = self._route
        try:
            words = self._words = netem_words(LinkSpec.parse(settings.link))
            for direction in words:
                for asked in (*delays({direction: "lo"}, words), _AWAY):
                    run_system(asked)
            how = "the kernel's netem"
        except BeyondNetemError as reason:
            self._leave_it_to_the_sides(str(reason))
            return
        except CommandFailedError as reason:
            if not guest.is_there():
                self._leave_it_to_the_sides(str(reason))
                return
            self._apply, how = self._route_in_guest, "netem of User-Mode Linux, as this kernel has none"
        _say(f"{how}: {'; '.join(f'{direction}: {said}' for direction, said in words.items())}")

    def look(self, now_s: float) -> None:
        """Set up anew what has changed, and count; CommandFailedError where it may not."""
        cable = self._find() or self._cable  # whoever is away comes back, most often to the same place
        in_guest = self._apply == self._route_in_guest
        if cable is None:
            return
        if cable != self._cable or (in_guest and self._told and not self.guest.running):
            self._apply(cable)
            self._cable, self._applied_s = cable, now_s
        if in_guest and not self._guest_is_up(cable, now_s):
            return
        if not self._settings.said.exists():  # the service `keys`, which each `up` runs anew, takes it away
            with output_file("--said", self._settings.said) as file:
                file.write("" if self._words is not None else self._settings.link)
        if not self._told:
            self._told = True
            _say(f"{cable.operator.name} to {cable.robot_address} over {cable.robot.name}")
        if self._settings.count.exists():
            self._count(cable, in_guest=in_guest)

    def _count(self, cable: Cable, *, in_guest: bool) -> None:
        """What netem has passed on and dropped, where there is one, and take away the file that asked for it."""
        if self._words is not None:
            queues = self._queues_of_guest() if in_guest else json.loads(run_system(_COUNT))
            if queues is None:
                return
            counted = count_packets(queues, self.guest.leaves() if in_guest else cable.leaves())
            write_json("--packets", self._settings.packets, {name: asdict(one) for name, one in counted.items()})
        self._asked = False
        self._settings.count.unlink()

    def _queues_of_guest(self) -> list[dict[str, Any]] | None:
        if not self._asked:
            self._asked = True
            self.guest.ask_for_queues()
            return None
        return self.guest.queues()

    def _find(self) -> Cable | None:
        try:
            found = socket.getaddrinfo(self._settings.robot, None, socket.AF_INET, socket.SOCK_STREAM)
        except socket.gaierror:
            return None
        shown = json.loads(run_system(["ip", "-json", "address"]))
        return find_cable(map(self.guest.with_taken_addresses, shown), str(found[0][4][0]))

    def _route(self, cable: Cable) -> None:
        run_system(["nft", "-f", "-"], cable.rules())
        for delay in delays(cable.leaves(), self._words, cable.mtu) if self._words is not None else ():
            run_system(delay)

    def _route_in_guest(self, cable: Cable) -> None:
        known = self._cable
        if self.guest.running and known is not None and replace(known, robot_address=cable.robot_address) == cable:
            self.guest.pass_on_to(cable.robot_address)
        elif self._words is not None:
            self.guest.start(cable, self._words)

    def _guest_is_up(self, cable: Cable, now_s: float) -> bool:
        """Whether it routes; where it never will, the sides are told to emulate."""
        if self.guest.up:
            return True
        gone = not self.guest.running or now_s - self._applied_s > _GUEST_LIMIT_S
        if gone and not self._told:
            self.guest.stop()
            self._leave_it_to_the_sides("User-Mode Linux does not start here")
            self._route(cable)
        return False

    def _leave_it_to_the_sides(self, why: str) -> None:
        self._words, self._apply = None, self._route
        _say(f"NO netem ({why}): the sides emulate the link themselves: {self._settings.link!r}")


def _say(text: str) -> None:
    sys.stdout.write(f"{PROGRAM}: {text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    run_command(PROGRAM, command)
