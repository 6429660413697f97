"""Emulated links that have names, in words that the kernel's netem also accepts; docs/link.md has figures and sources.

Single, infrequent packets have the published delays. Each link with jitter has a rate, because only then netem keeps
packets in order, as a radio's queue does; TCP would mistake disorder for loss. As a message waits for all before it,
frequent messages are delayed more than rare ones.
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
"""Words of each named link, keyed by name, in ascending order of delay."""


def with_names_spelled_out(spec: str) -> str:
    """Replace each clause of `spec` that is the name of a link by the words of that link; keep the other clauses."""
    return ";".join(NAMED_LINKS.get(clause.strip(), clause) for clause in spec.split(";"))
