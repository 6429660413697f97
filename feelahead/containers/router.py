"""Router between the two networks of docker/compose.yaml: `python -m feelahead.containers.router`.

The router forwards ports 5555 and 5556 from the operator's network to the robot side, under the router's own address.
So neither side needs a route or a privilege. The kernel's netem applies the link to outgoing packets, once for each
direction. If the kernel has no netem, or netem cannot emulate the link, the sides emulate it themselves. For this they
wait for the file `--said`: it holds the link to emulate, or nothing if netem does it. The log says which is the case.

Containers, addresses and interfaces may change. The router checks them twice a second, and sets up again what changed.
"""

import json
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro

from common.command.command_line import parse_settings, run_command
from common.command.stop_signal import StopSignal
from common.emulation.spec import Direction, LinkSpec
from common.errors import FeelaheadError
from common.files.output_file import output_file
from feelahead.containers.cable import Cable, delay, find_cable
from feelahead.containers.netem import BeyondNetemError, netem_words

PROGRAM = "feelahead-router"
_PERIOD_S: Final = 0.5
_MOST_FAILED: Final = 10
"""Number of consecutive failed checks after which the router ends."""
_LIMIT_S: Final = 10.0


class CommandFailedError(FeelaheadError):
    """The command ip, tc or nft ended with an error; the text is that of the command."""


@dataclass(frozen=True)
class RouterSettings:
    """Forward the robot side's ports from one network to another, over a link that netem emulates."""

    link: Annotated[str, tyro.conf.arg(metavar="NAME|SPEC")] = ""
    """Link, by name or in netem's words, as for feelahead-robot."""
    robot: Annotated[str, tyro.conf.arg(metavar="HOST")] = "robot-side"
    """Name or address of the robot side in its network."""
    said: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("/link/emulated")
    """File to write: the link that the sides must emulate themselves, or nothing if netem emulates it."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """File from which to read these settings."""

    def __post_init__(self) -> None:
        LinkSpec.parse(self.link)


def command(arguments: Sequence[str]) -> int:
    """Run the router until SIGTERM; raises CommandFailedError if the network cannot be set up."""
    router, failed = Router(parse_settings(RouterSettings, PROGRAM, arguments)), 0
    with StopSignal() as stop:
        while not stop.is_set:
            try:
                router.check()
                failed = 0
            except CommandFailedError as error:
                # For example, a network was removed during the check.
                failed += 1
                _say(str(error))
                if failed == _MOST_FAILED:
                    raise
            time.sleep(_PERIOD_S)
    return 0


class Router:
    """Sets up forwarding and link in the kernel, and sets up again what changed."""

    def __init__(self, settings: RouterSettings) -> None:
        self._settings = settings
        self._cable: Cable | None = None
        self._words: Mapping[Direction, str] | None = None
        """Arguments for netem, by direction; None: the sides emulate the link"""
        try:
            words = netem_words(LinkSpec.parse(settings.link))
            for direction, said in words.items():
                for tried in (*delay("lo", direction, said), ["tc", "qdisc", "del", "dev", "lo", "root"]):
                    run_system(tried)
            self._words = words
            _say(f"the kernel's netem: {'; '.join(f'{direction}: {said}' for direction, said in words.items())}")
        except (BeyondNetemError, CommandFailedError) as reason:
            _say(f"NO netem ({reason}): the sides emulate the link themselves: {settings.link!r}")

    def check(self) -> None:
        """Check addresses and interfaces once; set up again what changed. Raises CommandFailedError if that fails."""
        cable = self._find() or self._cable  # a side that is gone mostly comes back with the same address
        if cable is None:
            return
        if cable != self._cable:
            run_system(["nft", "-f", "-"], cable.rules())
            for words in () if self._words is None else cable.delays(self._words):
                run_system(words)
            if self._cable is None:
                _say(f"{cable.operator.name} to {cable.robot_address} over {cable.robot.name}")
            self._cable = cable
        if not self._settings.said.exists():  # each `up` runs the service `keys`, which removes the file
            with output_file("--said", self._settings.said) as file:
                file.write("" if self._words is not None else self._settings.link)

    def _find(self) -> Cable | None:
        try:
            found = socket.getaddrinfo(self._settings.robot, None, socket.AF_INET, socket.SOCK_STREAM)
        except socket.gaierror:
            return None
        return find_cable(json.loads(run_system(["ip", "-json", "address"])), str(found[0][4][0]))


def run_system(words: Sequence[str], given: str | None = None) -> str:
    """Run a command of the system with `given` as standard input, and return its output.

    Raises CommandFailedError if the command fails.
    """
    try:
        done = subprocess.run(words, input=given, capture_output=True, text=True, timeout=_LIMIT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CommandFailedError(f"{words[0]}: {error}") from error
    if done.returncode != 0:
        said = done.stderr.strip().splitlines()
        raise CommandFailedError(f"{' '.join(words)}: {said[0] if said else f'code {done.returncode}'}")
    return done.stdout


def _say(text: str) -> None:
    sys.stdout.write(f"{PROGRAM}: {text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    run_command(PROGRAM, command)
