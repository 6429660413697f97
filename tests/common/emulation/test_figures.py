"""What a run's summary says of its links, from both sides in virtual time."""

import json
from typing import Any

import pytest

from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

pytestmark = pytest.mark.long

LINK = (
    "to_operator: delay 30ms 5ms distribution normal loss 5% corrupt 5%; to_robot: delay 20ms duplicate 10%; "
    "to_operator.telemetry: rate 1mbit"
)


@pytest.fixture(scope="module")
def summary() -> dict[str, Any]:
    both = Loopback(
        LoopbackSettings(RobotSettings(link=LINK, full_rate=True), OperatorSettings(link=LINK, full_rate=True))
    )
    both.run_until(3.0)
    return both.summary()


def test_each_line_has_what_was_asked_beside_what_was_achieved(summary: dict[str, Any]) -> None:
    link = summary["link"]
    assert {name: line["asked"] for name, line in link.items()} == {
        "to_robot": "delay 20ms duplicate 10%",
        "to_operator": "delay 30ms 5ms distribution normal loss 5% corrupt 5%",
        "to_operator.telemetry": "rate 1mbit",
    }
    haptics, motion = link["to_operator"]["achieved"], link["to_robot"]["achieved"]
    assert haptics["delay_ms"]["mean"] == pytest.approx(30.0, abs=0.5)
    assert haptics["delay_ms"]["sd"] == pytest.approx(5.0, abs=0.4)
    assert haptics["loss_share"] == pytest.approx(0.05, abs=0.02)
    assert motion["delay_ms"]["p99"] == pytest.approx(20.0, abs=1e-6)
    assert motion["duplicate_share"] == pytest.approx(0.09, abs=0.03)
    json.dumps(link, allow_nan=False)


def test_the_other_side_sees_what_the_line_let_through(summary: dict[str, Any]) -> None:
    line = summary["link"]["to_operator"]["achieved"]
    messages = summary["messages"]
    assert line["corrupted"] > 0
    # A flipped bit makes most messages invalid; the others differ in a digit.
    assert messages["rejected"] > line["corrupted"] / 4
    assert messages["stiffness_received"] < messages["stiffness_sent"] - line["lost"]
