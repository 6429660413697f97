"""A run's status in words: the live line is never cut within a fact, and the story prints each change once."""

from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec.structs import replace as replaced
from rich.cells import cell_len

from common.command.live_line import _facts, live_line
from common.command.live_story import Resistance, Story, next_resistance
from common.command.live_view import LiveView
from common.protocol.session import SessionState
from common.status.codes import ConnectionState, Doing, LinkState, Sight
from common.status.statuses import OperatorStatus, RobotStatus, SideStatus

ROBOT = RobotStatus(nearest="tin", nearest_mm=84.2, target="carton", target_mm=120.4)
OPERATOR = OperatorStatus(
    link=LinkState.UP,
    state="armed",
    person=Doing.ADVANCING,
    delay_ms=12.4,
    l2_course_stiffness=0.0,
    r2_course_stiffness=0.34,
    l2_pulled=0.0,
    r2_pulled=0.62,
)


def approach(**changes: Any) -> LiveView:
    """Return the statuses of both sides during an approach; `changes` replace figures of either status."""
    return LiveView(replaced(ROBOT, **of(ROBOT, changes)), replaced(OPERATOR, **of(OPERATOR, changes)))


def of(one: SideStatus, changes: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in changes.items() if name in one.__struct_fields__}


names = st.one_of(st.none(), st.text(max_size=40))
shares = st.one_of(st.none(), st.floats(0.0, 1.0))
distances_mm = st.one_of(st.none(), st.floats())
views = st.builds(
    approach,
    person=st.sampled_from([None, *Doing]),
    state=st.sampled_from([None, "armed", "disarmed", "stopped"]),
    link=st.sampled_from(LinkState),
    link_reason=names,
    stopped_because=names,
    real_time=shares,
    delay_ms=distances_mm,
    r2_course_stiffness=shares,
    r2_pulled=shares,
    haptics=st.booleans(),
    nearest=names,
    nearest_mm=distances_mm,
    target=names,
    target_mm=distances_mm,
    target_centre_mm=distances_mm,
    holding=names,
    stands=st.booleans(),
)


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"state": "stopped", "stopped_because": "emergency stop"}, "STOPPED  emergency stop  "),
        ({"state": "stopped"}, "STOPPED  "),
        ({"state": "disarmed", "stopped_because": "no command for 312 ms"}, "DISARMED  no command for 312 ms  "),
        ({"link": LinkState.LOST, "state": None}, "LINK LOST  nothing heard from the robot  "),
        ({"link": LinkState.REFUSED, "link_reason": "8 observe"}, "REFUSED  8 observe  "),
        ({"controller": ConnectionState.LOST, "state": "disarmed"}, "CONTROLLER LOST  "),
        ({"feel": Sight.WAITING}, "RELEASE BOTH TRIGGERS  "),
        ({"state": "disarmed", "person": None}, "disarmed  L2/R2 pull 0/62% resist 0/0%  "),
        ({"state": "disarmed", "person": None, "owner": SessionState.READY}, "ready to arm  "),
        ({"state": "disarmed", "controller": ConnectionState.ABSENT}, "no controller  "),
        ({"link": LinkState.WAITING, "state": None}, "waiting for the robot side  "),
        ({"link": LinkState.WAITING, "link_reason": "no key"}, "waiting for the robot side  no key  "),
        ({"link": LinkState.OBSERVING, "place": 1, "waiting": 2}, "observing (1 of 2 waiting)  "),
        ({"person": Doing.NO_TARGET, "target": None, "target_mm": None}, "no target  "),
        ({"person": None}, "armed  "),
        ({"person": Doing.ARMING}, "armed  "),
        ({"person": Doing.ARMING, "state": "disarmed"}, "arming  "),
        ({"real_time": 0.2}, "advancing  20 % of real time  L2/R2"),
        ({"real_time": 0.97}, "advancing  L2/R2"),
    ],
)
def test_what_keeps_the_arm_from_moving_comes_first_and_in_words(changed: dict[str, Any], expected: str) -> None:
    view = approach(**changed)
    assert live_line(view, 79).startswith(expected)
    assert view.alarm is expected.partition("  ")[0].isupper()


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"holding": "carton"}, "holding carton"),
        ({"holding": "carton", "stands": True}, "holding carton, it stands"),
        ({"holding": "an object with a long name"}, "  holding  "),
        ({"target": None, "target_mm": None}, "no target"),
        ({"target_mm": None, "target_centre_mm": 1234.0}, "target centre 1.2m"),
        ({"target_mm": -3.0}, "target 0mm"),
    ],
)
def test_the_target_in_other_words(changed: dict[str, Any], expected: str) -> None:
    assert expected in live_line(approach(**changed), 79)


@given(view=views, width=st.integers(0, 200))
@example(view=approach(), width=79)
@example(view=approach(link=LinkState.LOST, link_reason="界" * 5), width=19)
def test_it_fits_and_holds_whole_facts_only(view: LiveView, width: int) -> None:
    line = live_line(view, width)
    assert cell_len(line) <= width
    # The most important fact is there as soon as it fits alone.
    assert line.startswith(view.phase) or cell_len(view.phase) > width
    left = line
    # Each fact is there as a whole, in order, or not at all.
    for _, text in _facts(view):
        if left == text or left.startswith(f"{text}  "):
            left = left[len(text) + 2 :]
    # Where space is tight, all facts are a little closer.
    phase, *rest = (text for _, text in _facts(view))
    assert left == "" or line == f"{phase}  {' '.join(rest)}"


def resting(**changes: Any) -> LiveView:
    return approach(**{"state": "disarmed", "person": Doing.RESTING, "nearest_mm": 80.0, "r2_pulled": 0.0} | changes)


def advancing(**changes: Any) -> LiveView:
    return approach(**{"nearest_mm": 80.0, "r2_course_stiffness": 0.0} | changes)


def told(*views: LiveView, step_s: float = 1.0) -> list[str]:
    story = Story()
    lines = [story.tell(100.0 + step_s * number, view) for number, view in enumerate(views)]
    return [line for line in lines if line is not None]


def test_a_run_reads_as_a_story() -> None:
    near: dict[str, Any] = {"nearest": "carton", "nearest_mm": 10.0, "target_mm": 10.0, "r2_pulled": 0.5}
    held = near | {"r2_course_stiffness": 0.5, "holding": "carton"}
    lines = told(
        resting(link=LinkState.WAITING),
        resting(),
        advancing(),
        advancing(**near, r2_course_stiffness=0.3),
        advancing(**near | {"nearest_mm": -0.5, "target_mm": -0.5}, r2_course_stiffness=1.0),
        advancing(**held, person=Doing.LIFTING),
        advancing(**held, person=Doing.LOWERING, stands=True),
        advancing(**held, person=Doing.LOWERING, stands=True, hindrance="joint 4 at its limit"),
        advancing(link=LinkState.LOST, link_reason="nothing heard", state=None),
    )
    assert lines == [
        "   0.0 s  waiting for the robot side",
        "   1.0 s  link up; resting",
        "   2.0 s  armed; advancing  (R2 pulled 62 %, nearest 80 mm, target 120 mm)",
        "   3.0 s  R2 stiffens to 30 %  (R2 pulled 50 %, nearest 10 mm, target 10 mm)",
        "   4.0 s  R2 resists fully; touches carton, as perceived  (R2 pulled 50 %, nearest 0 mm, target 0 mm)",
        "   5.0 s  lifting; R2 eases to 50 %; touches nothing; holds carton  (R2 pulled 50 %, nearest 10 mm)",
        "   6.0 s  lowering; the held object stands on something  (R2 pulled 50 %, nearest 10 mm)",
        "   7.0 s  the arm does not follow: joint 4 at its limit  (R2 pulled 50 %, nearest 10 mm)",
        "   8.0 s  LINK LOST: nothing heard; R2 yields freely, after up to 100 %; lets go of carton",
    ]


def test_what_the_finger_meets_is_said_and_not_what_the_course_leads_to() -> None:
    line = live_line(approach(r2_meets=8, r2_course_stiffness=0.0), 200)
    assert "resist 0/100%" in line
    assert "danger 0/50%" in live_line(approach(r2_meets=0, r2_course_stiffness=0.5, haptics=False), 200)


def test_after_its_reset_a_stop_is_no_longer_said() -> None:
    reset = approach(state="stopped", stopped_because="emergency stop", person=Doing.READY, stop_reset=True)
    assert (reset.phase, reset.alarm) == ("ready: hold-to-run arms", False)
    assert (reset.border, reset.reason) == ("disarmed", None)


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


def test_an_alarm_does_not_wait_even_if_it_is_short() -> None:
    stopped = resting(state="stopped", stopped_because="emergency stop")
    lines = told(advancing(), stopped, advancing(), advancing(), step_s=0.01)
    assert [line.partition(" s  ")[2] for line in lines[1:]] == ["STOPPED: emergency stop"]
