"""The router's connection between the two networks (cable): its interfaces, and commands that configure the kernel."""

import ipaddress
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, get_args

from common.emulation.spec import Direction

PORTS: Final = "5555, 5556"
"""TCP ports of control and view, as nft writes a set."""
_SEGMENTING: Final = "tbf rate 2gbit burst {burst} limit 10mb"
"""Queue before netem. It splits large packets whose segmentation the sender left to the interface, so that netem
sees packets as on a wire."""
_HEADERS_BYTES: Final = 100
"""Bytes of headers that come on top of the interface's MTU in one frame."""
HANDLES: Final[Mapping[Direction, str]] = {direction: f"{n}:" for n, direction in enumerate(get_args(Direction), 2)}
"""Handle of the netem queue of each direction."""


@dataclass(frozen=True)
class End:
    """One network interface of the router."""

    name: str
    number: int
    """The interface's number in the kernel; it changes when the interface is removed and added again."""
    address: str
    """Address with the prefix length of its network, as 172.18.0.2/16."""
    mtu: int = 1500


@dataclass(frozen=True)
class Cable:
    """The router's present interfaces to both networks, and the robot side's address."""

    robot: End
    operator: End
    robot_address: str
    """Address of the robot side."""

    def rules(self) -> str:
        """Return rules for nft, which applies all or none: forward only PORTS, under the router's own address."""
        return f"""
            table ip feelahead
            delete table ip feelahead
            table ip feelahead {{
                chain there {{
                    type nat hook prerouting priority dstnat;
                    iifname "{self.operator.name}" tcp dport {{ {PORTS} }} dnat to {self.robot_address}
                }}
                chain under_our_address {{
                    type nat hook postrouting priority srcnat;
                    oifname "{self.robot.name}" masquerade
                }}
                chain only_these {{
                    type filter hook forward priority filter; policy drop;
                    iifname "{self.operator.name}" oifname "{self.robot.name}" tcp dport {{ {PORTS} }} accept
                    iifname "{self.robot.name}" ct state established accept
                }}
            }}
            """

    def delays(self, words: Mapping[Direction, str]) -> list[list[str]]:
        """Return the commands that delay the packets to each side. words: netem's arguments for each direction."""
        ends: Mapping[Direction, End] = {"to_robot": self.robot, "to_operator": self.operator}
        mtu = max(self.robot.mtu, self.operator.mtu)
        return [line for direction, end in ends.items() for line in delay(end.name, direction, words[direction], mtu)]


def delay(interface: str, direction: Direction, words: str, mtu: int = 1500) -> list[list[str]]:
    """Return the commands that delay the packets leaving by an interface: first split large ones, then netem."""
    queue = ["tc", "qdisc", "replace", "dev", interface]
    cutter = _SEGMENTING.format(burst=mtu + _HEADERS_BYTES).split()
    netem = ["parent", "1:", "handle", HANDLES[direction], "netem", *words.split()]
    return [[*queue, "root", "handle", "1:", *cutter], [*queue, *netem]]


def find_cable(interfaces: Iterable[Mapping[str, Any]], robot_address: str) -> Cable | None:
    """Find the router's two interfaces in the output of `ip -json address`.

    None unless exactly one address is in the robot side's network and exactly one in another.
    """
    ends: dict[bool, list[End]] = {True: [], False: []}
    for shown in interfaces:
        for held in shown["addr_info"]:
            if held["family"] == "inet" and shown["ifname"] != "lo":
                end = End(shown["ifname"], shown["ifindex"], f"{held['local']}/{held['prefixlen']}", shown["mtu"])
                near = ipaddress.ip_address(robot_address) in ipaddress.ip_interface(end.address).network
                ends[near].append(end)
    if len(ends[True]) != 1 or len(ends[False]) != 1:
        return None
    return Cable(ends[True][0], ends[False][0], robot_address)
