"""Links by name, in words that the kernel's netem accepts, too; docs/link.md has published figures and sources.

Single, infrequent packets see the published delays. Each link with jitter has a rate, because only then netem keeps
packets in order, as a radio's queue does; TCP would take disorder for loss. A message waits for the slowest one
before it: frequent messages see more delay than rare ones.
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
"""Links in order of delay."""


def with_names_spelled_out(spec: str) -> str:
    """Replace each clause that is a link's name by the link's words; keep the rest."""
    return ";".join(NAMED_LINKS.get(clause.strip(), clause) for clause in spec.split(";"))
