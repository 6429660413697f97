"""Speed assistance: the arm can always stop before the distance of full strength, and can still touch the target."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.messages import Header, MotionCommand, TriggerField
from common.touch_speed import touch_speed_m_s
from robot_side.arm.speed_assist import FOLLOWS_S, assisted, fastest_m_s

FULL_M_S, ACCELERATION = 0.25, 3.0
ways = st.floats(-0.05, 0.3)
repeatable = settings(derandomize=True, deadline=None)


def field(fast_m: float, slow_m: float | None = None) -> TriggerField:
    slow = fast_m if slow_m is None else slow_m
    return TriggerField((fast_m,) * 8, (slow,) * 8, FULL_M_S, ACCELERATION, displacement_m=0.0, course_stiffness=0.0)


def command(l2: float, r2: float) -> MotionCommand:
    return MotionCommand(Header(1, 1, 0.0), l2, r2, lateral=(0.3, -0.2), run=True, gripper=1.0)


@repeatable
@given(distance_m=ways, response_s=st.floats(0.0, 0.5))
def test_from_the_fastest_speed_the_arm_stops_in_time(distance_m: float, response_s: float) -> None:
    speed, follows_s = fastest_m_s(field(distance_m), response_s), FOLLOWS_S + response_s
    assert speed * follows_s + speed * speed / (2.0 * ACCELERATION) == pytest.approx(max(distance_m, 0.0), abs=1e-12)


@repeatable
@given(fast_m=ways, slow_m=ways)
def test_what_is_to_be_touched_may_be_at_touching_speed(fast_m: float, slow_m: float) -> None:
    speed = fastest_m_s(field(fast_m, slow_m))
    assert speed >= min(fastest_m_s(field(slow_m)), touch_speed_m_s(FULL_M_S)) - 1e-12
    assert speed <= max(fastest_m_s(field(fast_m)), touch_speed_m_s(FULL_M_S)) + 1e-12


@repeatable
@given(l2=st.floats(0.0, 1.0), r2=st.floats(0.0, 1.0), back_m=ways, forth_m=ways)
def test_travel_is_never_more_than_asked_and_the_rest_is_left_alone(
    l2: float, r2: float, back_m: float, forth_m: float
) -> None:
    asked = command(l2, r2)
    given_ = assisted(asked, field(back_m), field(forth_m))
    before, after = r2 - l2, given_.r2 - given_.l2
    assert abs(after) <= abs(before)
    assert before * after >= 0.0
    assert (given_.lateral, given_.run, given_.gripper) == (asked.lateral, asked.run, asked.gripper)
    allowed = fastest_m_s(field(forth_m if before > 0.0 else back_m)) / FULL_M_S
    assert abs(after) == pytest.approx(min(abs(before), allowed))
