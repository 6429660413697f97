"""What the kernel's netem is told, and when it is not asked."""

from collections.abc import Mapping
from typing import Any

import pytest

from common.emulation.profile import LinkProfile
from common.emulation.spec import Direction, LinkSpec
from feelahead.containers.netem import BeyondNetemError, Counted, count_packets, netem_words


def words(spec: str) -> Mapping[Direction, str]:
    return netem_words(LinkSpec.parse(spec))


def test_each_direction_gets_its_own_words() -> None:
    said = words("to_robot: delay 20ms; to_operator: delay 50ms 10ms distribution normal loss 1% limit 2000")
    assert said["to_robot"] == "delay 20ms"
    assert LinkProfile.parse(said["to_operator"]) == LinkProfile.parse(
        "delay 50ms 10ms distribution normal loss 1% limit 2000"
    )


def test_nothing_asked_for_is_no_delay() -> None:
    assert words("") == {"to_robot": "delay 0ms", "to_operator": "delay 0ms"}


@pytest.mark.parametrize(
    ("spec", "why"),
    [
        ("delay 10ms 5ms distribution exponential", "distribution"),
        ("delay 10ms outage 1s at 2s", "outage"),
        ("to_operator.telemetry: delay 5ms", "streams"),
        ("to_robot: outage 1s at 2s", "to_robot: outage"),
    ],
)
def test_what_netem_cannot_do_is_left_to_the_sides(spec: str, why: str) -> None:
    with pytest.raises(BeyondNetemError, match=why):
        words(spec)


def test_a_clause_of_video_changes_nothing() -> None:
    """Nothing sends video yet, and what is not sent needs no netem."""
    assert words("delay 5ms; video: rate 2mbit")["to_operator"] == "delay 5ms"


QUEUES: list[dict[str, Any]] = [
    {"kind": "noqueue", "dev": "lo", "packets": 9, "drops": 0},
    {"kind": "netem", "dev": "eth0", "packets": 990, "drops": 10},
    {"kind": "netem", "dev": "eth1", "packets": 500, "drops": 0},
]


def test_packets_are_counted_by_direction() -> None:
    counted = count_packets(QUEUES, {"to_robot": "eth1", "to_operator": "eth0"})
    assert counted == {"to_robot": Counted(500, 0), "to_operator": Counted(990, 10)}


def test_a_direction_without_netem_is_not_counted() -> None:
    assert count_packets(QUEUES, {"to_robot": "eth2"}) == {}


def test_the_share_that_was_lost_is_of_what_came_since() -> None:
    assert Counted(990, 10).lost_share_since(Counted(0, 0)) == 0.01
    assert Counted(1089, 11).lost_share_since(Counted(990, 10)) == 0.01
    assert Counted(990, 10).lost_share_since(Counted(990, 10)) is None


def test_what_was_set_up_anew_meanwhile_tells_nothing() -> None:
    assert Counted(5, 0).lost_share_since(Counted(990, 0)) is None
    assert Counted(2000, 0).lost_share_since(Counted(990, 10)) is None
