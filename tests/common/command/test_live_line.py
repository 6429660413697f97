"""The live line without a terminal: what it says, and that it never says half of something."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from rich.cells import cell_len

from common.command.live_line import _facts, live_line
from common.command.live_view import LiveView, TriggerView, live_view

APPROACH: dict[str, Any] = {
    **{"link": "up", "state": "armed", "person": "advancing", "delay_ms": 12.4, "haptics": True},
    **{"L2": 0.0, "R2": 0.34, "L2_pulled": 0.0, "R2_pulled": 0.62},
    **{"nearest": "tin", "nearest_mm": 84.2, "target": "carton", "target_mm": 120.4, "holding": "nothing"},
}

names = st.one_of(st.none(), st.text(max_size=40))
shares = st.one_of(st.none(), st.floats(0.0, 1.0))
distances_mm = st.one_of(st.none(), st.floats(-1e3, 1e7))
triggers = st.builds(TriggerView, shares, shares)
views = st.builds(
    LiveView,
    phase=st.one_of(st.sampled_from(["advancing", "STOPPED", "LINK LOST"]), st.text(max_size=90)),
    reason=names,
    alarm=st.booleans(),
    linked=st.one_of(st.none(), st.booleans()),
    real_time=shares,
    delay_ms=distances_mm,
    l2=triggers,
    r2=triggers,
    haptics=st.booleans(),
    nearest=names,
    nearest_mm=distances_mm,
    has_target=st.one_of(st.none(), st.booleans()),
    target_mm=distances_mm,
    target_centre_mm=distances_mm,
    holding=names,
)


def test_eighty_columns_tell_everything() -> None:
    assert live_line(live_view(APPROACH), 79) == (
        "advancing  L2/R2 pull 0/62% resist 0/34%  near 84mm  target 120mm  link 12ms"
    )
    far = {"R2_pulled": 1.0, "R2": 1.0, "nearest_mm": 144.0, "target_mm": 193.0, "delay_ms": 205.0}
    assert live_line(live_view(APPROACH | far), 79) == (
        "advancing  L2/R2 pull 0/100% resist 0/100% near 144mm target 193mm link 205ms"
    )


def test_a_simulation_that_falls_behind_is_told() -> None:
    assert live_line(live_view(APPROACH | {"real_time": 0.97}), 79) == live_line(live_view(APPROACH), 79)
    assert live_line(live_view(APPROACH | {"real_time": 0.2}), 99) == (
        "advancing  20 % of real time  L2/R2 pull 0/62% resist 0/34%  near 84mm  target 120mm  link 12ms"
    )


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"state": "stopped", "stopped_because": "emergency stop"}, "STOPPED  emergency stop  "),
        ({"state": "stopped"}, "STOPPED  "),
        ({"state": "disarmed", "stopped_because": "no command for 312 ms"}, "DISARMED  no command for 312 ms  "),
        ({"link": "lost: nothing heard from the robot", "state": None}, "LINK LOST  nothing heard from the robot  "),
        ({"link": "refused: 8 others observe already"}, "REFUSED  8 others observe already  "),
        ({"controller": "lost", "state": "disarmed"}, "CONTROLLER LOST  "),
        ({"release_first": True}, "RELEASE BOTH TRIGGERS  "),
        ({"state": "disarmed", "person": None}, "disarmed  L2/R2 pull 0/62% resist 0/0%  "),
        ({"state": "disarmed", "person": None, "owner": "ready"}, "ready to arm  "),
        ({"state": "disarmed", "controller": "absent"}, "no controller  "),
        ({"link": "waiting for the robot side", "state": None}, "waiting for the robot side  "),
        ({"person": "no target", "target": None, "target_mm": None}, "no target  "),
        ({"person": None}, "armed  "),
        ({"person": "arming"}, "armed  "),
        ({"person": "arming", "state": "disarmed"}, "arming  "),
    ],
)
def test_what_keeps_the_arm_from_moving_comes_first_and_in_words(changed: dict[str, Any], expected: str) -> None:
    view = live_view(APPROACH | changed)
    assert live_line(view, 79).startswith(expected)
    assert view.alarm is expected.partition("  ")[0].isupper()


def test_what_is_not_known_is_no_zero() -> None:
    line = live_line(live_view({"link": "up"}), 79)
    assert line == "starting  L2/R2 pull –/–% resist –/–%  near –mm  target –mm  link –ms"
    assert live_line(live_view({"nearest_mm": math.nan, "R2": math.inf, "L2": True}), 79) == (
        "starting  L2/R2 pull –/–% resist –/–%  near –mm  target –mm"
    )


def test_without_haptics_nothing_resists() -> None:
    line = live_line(live_view(APPROACH | {"haptics": False}), 79)
    assert "resist" not in line
    assert "danger" in line


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"holding": "carton"}, "holding carton"),
        ({"holding": "an object with a long name"}, "  holding  "),
        ({"target": None, "target_mm": None}, "no target"),
        ({"target_mm": None, "target_centre_mm": 1234.0}, "target centre 1.2m"),
        ({"target_mm": -3.0}, "target 0mm"),
    ],
)
def test_the_target_in_other_words(changed: dict[str, Any], expected: str) -> None:
    assert expected in live_line(live_view(APPROACH | changed), 79)


def test_control_characters_of_a_peer_do_not_reach_the_terminal() -> None:
    view = live_view({"link": "refused: \x1b[2J\nhello", "nearest": "a\rb", "holding": "\x07"})
    assert (view.reason, view.nearest, view.holding) == ("?[2J?hello", "a?b", "?")


@given(view=views, width=st.integers(0, 200))
@example(view=live_view(APPROACH), width=79)
@example(view=replace(LiveView(), phase="界" * 5), width=9)
def test_it_fits_and_holds_whole_facts_only(view: LiveView, width: int) -> None:
    line = live_line(view, width)
    assert cell_len(line) <= width
    # What is most important is there as soon as it fits by itself.
    assert line.startswith(view.phase) or cell_len(view.phase) > width
    left = line
    # Each fact is there as a whole, in its place, or not at all.
    for _, text in _facts(view):
        if left == text or left.startswith(f"{text}  "):
            left = left[len(text) + 2 :]
    # Where it is tight, all facts stand a little closer.
    phase, *rest = (text for _, text in _facts(view))
    assert left == "" or line == f"{phase}  {' '.join(rest)}"
