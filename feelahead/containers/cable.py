"""The cable between the two networks: which interface leads where, and what has to be said to the kernel about it."""

import ipaddress
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from common.emulation.spec import Direction

PORTS: Final = (5555, 5556)
"""Control and view."""
_SEGMENTING: Final = "tbf rate 2gbit burst {burst} limit 10mb"
"""Cuts what a sender left to its interface to cut: netem is to see packets as a wire has them."""
_HEADERS_BYTES: Final = 100
"""Of the frame, around what the interface's limit counts."""


@dataclass(frozen=True)
class End:
    """One of the router's interfaces."""

    name: str
    number: int
    """The kernel's; another one when the interface went and came back."""
    mac: str
    address: str
    """With the length of the network's prefix."""
    mtu: int = 1500


@dataclass(frozen=True)
class Cable:
    """The way between the networks, as it is at the moment."""

    robot: End
    operator: End
    robot_address: str
    """Of the robot side itself."""

    @property
    def mtu(self) -> int:
        """The largest packet of either network, in bytes."""
        return max(self.robot.mtu, self.operator.mtu)

    def leaves(self) -> dict[Direction, str]:
        """The interface by which each direction leaves the router."""
        return {"to_robot": self.robot.name, "to_operator": self.operator.name}

    def rules(self) -> str:
        """For nft, which applies all or nothing: pass the ports on, under our own address, and nothing else."""
        ports = ", ".join(map(str, PORTS))
        return f"""
            table ip feelahead
            delete table ip feelahead
            table ip feelahead {{
                chain there {{
                    type nat hook prerouting priority dstnat;
                    iifname "{self.operator.name}" tcp dport {{ {ports} }} dnat to {self.robot_address}
                }}
                chain under_our_address {{
                    type nat hook postrouting priority srcnat;
                    oifname "{self.robot.name}" masquerade
                }}
                chain only_these {{
                    type filter hook forward priority filter; policy drop;
                    iifname "{self.operator.name}" oifname "{self.robot.name}" tcp dport {{ {ports} }} accept
                    iifname "{self.robot.name}" ct state established accept
                }}
            }}
            """


def delays(leaves: Mapping[Direction, str], words: Mapping[Direction, str], mtu: int = 1500) -> list[list[str]]:
    """The commands that delay what leaves towards each side: a cutter, and netem behind it."""
    commands = []
    for direction, interface in leaves.items():
        queue = ["tc", "qdisc", "replace", "dev", interface]
        cutter = _SEGMENTING.format(burst=mtu + _HEADERS_BYTES).split()
        commands.append([*queue, "root", "handle", "1:", *cutter])
        commands.append([*queue, "parent", "1:", "handle", "2:", "netem", *words[direction].split()])
    return commands


def find_cable(interfaces: Iterable[Mapping[str, Any]], robot_address: str) -> Cable | None:
    """The cable among what `ip -json address` shows; None unless there is one interface with an address each way."""
    robots: list[End] = []
    others: list[End] = []
    for shown in interfaces:
        for held in shown["addr_info"]:
            if held["family"] != "inet" or shown["ifname"] == "lo":
                continue
            address = f"{held['local']}/{held['prefixlen']}"
            end = End(shown["ifname"], shown["ifindex"], shown["address"], address, shown["mtu"])
            near = ipaddress.ip_address(robot_address) in ipaddress.ip_interface(end.address).network
            (robots if near else others).append(end)
    return Cable(robots[0], others[0], robot_address) if len(robots) == len(others) == 1 else None
