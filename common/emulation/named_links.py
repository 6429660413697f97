"""Links by name, in words that the kernel's netem takes, too, and where their figures come from.

A single packet now and then sees the published delays. Each link with jitter has a rate, because only then netem keeps
packets in order, as a radio's queue does, and TCP would take the disorder for loss. So a message waits for the
slowest one before it: many a second see more delay than a few do.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True)
class NamedLink:
    """One link, as `--link` knows it."""

    spec: str
    """In the grammar's words."""
    what: str
    """What it is, in a few words."""
    figures: str
    """What was published; times are round trips, measured by single packets."""
    source: str
    """Where it was published, and what is assumed."""


NAMED_LINKS: Final[Mapping[str, NamedLink]] = MappingProxyType(
    {
        "lan": NamedLink(
            "delay 200us rate 1gbit",
            "a few switches on a cable",
            "none",
            "assumed",
        ),
        "wifi": NamedLink(
            "delay 3ms 8ms distribution pareto loss 0.1% rate 50mbit",
            "Wi-Fi that others use, too",
            "p50 3 ms, p90 20 ms, p99 250 ms",
            "Sui et al., Characterizing and Improving WiFi Latency in Large-Scale Operational Networks, MobiSys 2016 "
            "(47 000 devices); netem's tables end at p99 38 ms; loss and rate assumed",
        ),
        "lte": NamedLink(
            "to_robot: delay 20ms 5ms distribution pareto rate 50mbit; "
            "to_operator: delay 29ms 8ms distribution pareto rate 20mbit",
            "the robot on LTE",
            "mean 49 ms, least 40 ms, loss 0.0001 %",
            "Signals Research in Houston, after Rayal, Latency: LTE's Achilles' Heel, 2011; loss, here none: 3GPP TS "
            "23.203, QCI 9; rates and how the two directions share it assumed",
        ),
        "low-orbit": NamedLink(
            "delay 25ms 4ms distribution normal loss gemodel 0.3% 30% rate 50mbit",
            "a terminal of Starlink",
            "p50 50 ms, 6.7 ms from one to the next, loss 1 to 2 %",
            "Michel et al., A First Look at Starlink Performance, IMC 2022 (delay); Huston, A Transport Protocol's "
            "View of Starlink, APNIC 2024 (jitter, loss); bursts of 3 and rate assumed, handovers each 15 s left out",
        ),
        "intercontinental": NamedLink(
            "delay 88ms 1ms distribution normal rate 100mbit",
            "Paris to California",
            "mean 175 and 176 ms",
            "Reinheimer, Miles per Millisecond, WonderProxy (Paris and Fremont); jitter, rate and no loss assumed",
        ),
        "satellite": NamedLink(
            "to_robot: delay 300ms 2ms distribution normal rate 100mbit; "
            "to_operator: delay 300ms 2ms distribution normal rate 10mbit",
            "a geostationary satellite",
            "about 600 ms; 100 and 10 Mbit/s",
            "Huston, Testing LEO and GEO Satellite Services in Australia, APNIC 2022 (delay); Michel et al., IMC 2022 "
            "(rates of the subscription beside); jitter and no loss assumed",
        ),
    }
)
"""In order of delay."""


def with_names_spelled_out(spec: str) -> str:
    """`spec` with each clause that is a link's name replaced by its words; all else as it was."""
    clauses = spec.split(";")
    if not any(clause.strip() in NAMED_LINKS for clause in clauses):
        return spec
    return ";".join(NAMED_LINKS[name].spec if (name := clause.strip()) in NAMED_LINKS else clause for clause in clauses)
