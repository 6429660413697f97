"""A file is told of a run: every change that a person cares about, once, and nothing in between."""

from dataclasses import replace

import pytest

from common.command.live_story import SHORTEST_GAP_S, Resistance, Story, next_resistance
from common.command.live_view import LiveView, TriggerView

RESTING = LiveView(
    phase="resting",
    linked=True,
    l2=TriggerView(0.0, 0.0),
    r2=TriggerView(0.0, 0.0),
    nearest="tin",
    nearest_mm=80.0,
    has_target=True,
    target_mm=120.0,
)
ADVANCING = replace(RESTING, phase="advancing", armed=True, r2=TriggerView(0.62, 0.0))


def told(*views: LiveView, step_s: float = 1.0) -> list[str]:
    story = Story()
    lines = [story.tell(100.0 + step_s * number, view) for number, view in enumerate(views)]
    return [line for line in lines if line is not None]


def test_a_run_reads_as_a_story() -> None:
    near = replace(ADVANCING, nearest="carton", nearest_mm=10.0, target_mm=10.0, r2=TriggerView(0.5, 0.3))
    lines = told(
        replace(RESTING, phase="waiting for the robot side", linked=False),
        RESTING,
        ADVANCING,
        near,
        replace(near, nearest_mm=-0.5, target_mm=-0.5, r2=TriggerView(0.5, 1.0)),
        replace(near, r2=TriggerView(0.5, 0.5), phase="lifting", holding="carton"),
        replace(ADVANCING, phase="LINK LOST", reason="nothing heard", alarm=True, linked=False, armed=False),
    )
    assert lines == [
        "   0.0 s  waiting for the robot side",
        "   1.0 s  link up; resting",
        "   2.0 s  armed; advancing  (R2 pulled 62 %, nearest 80 mm, target 120 mm)",
        "   3.0 s  R2 stiffens to 30 %  (R2 pulled 50 %, nearest 10 mm, target 10 mm)",
        "   4.0 s  R2 resists fully; touches carton, as perceived  (R2 pulled 50 %, nearest 0 mm, target 0 mm)",
        "   5.0 s  lifting; R2 eases to 50 %; touches nothing; holds carton  (R2 pulled 50 %, nearest 10 mm)",
        "   6.0 s  LINK LOST: nothing heard; R2 yields freely, after up to 100 %; lets go of carton",
    ]


@pytest.mark.parametrize(
    ("stiffnesses", "expected"),
    [
        ([0.04, 0.06, 0.04, 0.02, 0.06, 0.005], "0 1 1 1 1 0"),
        ([0.9, 0.96, 0.9, 0.86, 0.84, 0.9], "1 2 2 2 1 1"),
        ([1.0, 0.0, 1.0], "2 0 2"),
    ],
)
def test_a_stiffness_that_hovers_is_one_word(stiffnesses: list[float], expected: str) -> None:
    word, words = Resistance.NONE, []
    for stiffness in stiffnesses:
        word = next_resistance(word, stiffness)
        words.append(str(int(word)))
    assert " ".join(words) == expected


def test_a_touch_that_rattles_is_told_once() -> None:
    rattling = [replace(ADVANCING, nearest_mm=0.0 if step % 2 else 5.0) for step in range(40)]
    assert len(told(*rattling)) == 2


def test_what_goes_to_and_fro_is_bounded() -> None:
    flapping = [replace(ADVANCING, phase=("advancing", "grasping")[step % 2]) for step in range(1000)]
    assert len(told(*flapping, step_s=0.01)) <= 10.0 / SHORTEST_GAP_S + 1


def test_an_alarm_does_not_wait_even_if_it_is_short() -> None:
    stopped = replace(RESTING, phase="STOPPED", reason="emergency stop", alarm=True)
    lines = told(ADVANCING, stopped, ADVANCING, ADVANCING, step_s=0.01)
    assert [line.partition(" s  ")[2] for line in lines[1:]] == ["STOPPED: emergency stop"]
