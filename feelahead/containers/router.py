"""The router between the two networks of docker/compose.yaml: `python -m feelahead.containers.router`.

It passes what arrives at its ports 5555 and 5556 from the operator's network on to the robot side, under its own
address, so that neither side needs a route or a right of its own; and it applies the link, one netem for each
direction, to what leaves it. Where the kernel has no netem, or the link asks for more than that can do, it says so and
leaves the emulation to the sides: they wait for the file `--said`, which has the link that they are to emulate.

Containers come and go, and so do addresses and interfaces: it looks twice a second, and sets up anew what changed.
"""

import ipaddress
import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from common.command.command_line import parse_settings, run_command
from common.command.stop_signal import StopSignal
from common.emulation.spec import Direction, LinkSpec
from common.errors import FeelaheadError
from common.files.output_file import output_file, write_json
from feelahead.containers.netem import BeyondNetemError, count_packets, netem_words

PROGRAM = "feelahead-router"
PORTS = (5555, 5556)
"""Control and view."""
_PERIOD_S = 0.5
_LIMIT_S = 10.0


class CommandFailedError(FeelaheadError):
    """A command of the system's ended with an error; the text is what it said."""


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
    """Where to write, twice a second, what netem has passed on and dropped in each direction."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        LinkSpec.parse(self.link)


@dataclass(frozen=True)
class Cable:
    """The way between the networks, as it is at the moment."""

    robot_interface: str
    operator_interface: str
    robot_address: str

    def rules(self) -> str:
        """For nft, which applies all or nothing: pass the ports on, under our own address, and nothing else."""
        ports = ", ".join(map(str, PORTS))
        return f"""
            table ip feelahead
            delete table ip feelahead
            table ip feelahead {{
                chain there {{
                    type nat hook prerouting priority dstnat;
                    iifname "{self.operator_interface}" tcp dport {{ {ports} }} dnat to {self.robot_address}
                }}
                chain under_our_address {{
                    type nat hook postrouting priority srcnat;
                    oifname "{self.robot_interface}" masquerade
                }}
                chain only_these {{
                    type filter hook forward priority filter; policy drop;
                    iifname "{self.operator_interface}" oifname "{self.robot_interface}" tcp dport {{ {ports} }} accept
                    iifname "{self.robot_interface}" ct state established accept
                }}
            }}
            """

    def delays(self, words: Mapping[Direction, str]) -> list[list[str]]:
        """The arguments for tc: what leaves towards a side is what was sent to it."""
        return [
            ["tc", "qdisc", "replace", "dev", interface, "root", "netem", *words[direction].split()]
            for direction, interface in self.leaves().items()
        ]

    def leaves(self) -> dict[Direction, str]:
        """The interface by which each direction leaves us."""
        return {"to_robot": self.robot_interface, "to_operator": self.operator_interface}


def find_cable(interfaces: Iterable[Mapping[str, Any]], robot_address: str) -> Cable | None:
    """The cable among what `ip -json -4 address` shows; None unless there is one interface on each side."""
    robots: list[str] = []
    others: list[str] = []
    for interface in interfaces:
        name = interface["ifname"]
        networks = [
            ipaddress.ip_interface(f"{held['local']}/{held['prefixlen']}").network for held in interface["addr_info"]
        ]
        if name != "lo" and networks:
            near = any(ipaddress.ip_address(robot_address) in network for network in networks)
            (robots if near else others).append(name)
    return Cable(robots[0], others[0], robot_address) if len(robots) == len(others) == 1 else None


def command(arguments: Sequence[str]) -> int:
    """Route until SIGTERM; 1 when the network may not be changed."""
    settings = parse_settings(RouterSettings, PROGRAM, arguments)
    words = _netem_for(settings.link)
    there: Cable | None = None
    with StopSignal() as stop:
        while not stop.is_set:
            cable = _look(settings.robot)
            if cable is not None and cable != there:
                _run(["nft", "-f", "-"], cable.rules())
                for delay in cable.delays(words) if words is not None else ():
                    _run(delay)
                with output_file("--said", settings.said) as file:
                    file.write("" if words is not None else settings.link)
                _say(f"{cable.operator_interface} to {cable.robot_address} over {cable.robot_interface}")
            there = cable
            if cable is not None and words is not None:
                queues = json.loads(_run(["tc", "-statistics", "-json", "qdisc", "show"]))
                counted = count_packets(queues, cable.leaves())
                write_json("--packets", settings.packets, {name: asdict(one) for name, one in counted.items()})
            time.sleep(_PERIOD_S)
    return 0


def _netem_for(link: str) -> Mapping[Direction, str] | None:
    """netem's words; None where the sides have to emulate the link."""
    try:
        words = netem_words(LinkSpec.parse(link))
        _run(["tc", "qdisc", "replace", "dev", "lo", "root", "netem", "delay", "0ms"])
        _run(["tc", "qdisc", "del", "dev", "lo", "root"])
    except (BeyondNetemError, CommandFailedError) as reason:
        _say(f"NO netem ({reason}): the sides emulate the link themselves: {link!r}")
        return None
    _say(f"netem: {'; '.join(f'{direction}: {said}' for direction, said in words.items())}")
    return words


def _look(robot: str) -> Cable | None:
    try:
        found = socket.getaddrinfo(robot, None, socket.AF_INET, socket.SOCK_STREAM)
    except socket.gaierror:
        return None
    return find_cable(json.loads(_run(["ip", "-json", "-4", "address"])), str(found[0][4][0]))


def _run(words: Sequence[str], given: str | None = None) -> str:
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
