"""Links by name, in words that the kernel's netem takes, too; docs/link.md has their published figures and sources.

A single packet now and then sees the published delays. Each link with jitter has a rate, because only then netem keeps
packets in order, as a radio's queue does, and TCP would take the disorder for loss. So a message waits for the
slowest one before it: many a second see more delay than a few do.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

NAMED_LINKS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "lan": "delay 200us rate 1gbit",
        "wifi": "delay 3ms 8ms distribution pareto loss 0.1% rate 50mbit",
        "lte": "to_robot: delay 20ms 5ms distribution pareto rate 50mbit; "
        "to_operator: delay 29ms 8ms distribution pareto rate 20mbit",
        "low-orbit": "delay 25ms 4ms distribution normal loss gemodel 0.3% 30% rate 50mbit",
        "intercontinental": "delay 88ms 1ms distribution normal rate 100mbit",
        "satellite": "to_robot: delay 300ms 2ms distribution normal rate 100mbit; "
        "to_operator: delay 300ms 2ms distribution normal rate 10mbit",
    }
)
"""The links in order of delay."""


def with_names_spelled_out(spec: str) -> str:
    """`spec` with each clause that is a link's name replaced by its words; all else as it was."""
    return ";".join(NAMED_LINKS.get(clause.strip(), clause) for clause in spec.split(";"))
