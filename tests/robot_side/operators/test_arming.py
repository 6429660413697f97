"""Arming needs all inputs at rest, and a press that does not arm is answered by a reason."""

from typing import Any

import pytest

from tests.robot_side.session_bench import Bench


@pytest.mark.parametrize(
    ("held", "says"),
    [
        ({"r2": 0.3}, "a trigger is pulled"),
        ({"lateral": (0.0, -0.03)}, "a stick is deflected"),
        ({"turning": (0.03, 0.0)}, "a stick is deflected"),
        ({"gripper": -1.0}, "a gripper button is held"),
        ({"home": 0.25}, "home is held"),
        ({"emergency_stop": True}, "the emergency stop is held"),
    ],
)
def test_the_operator_reads_which_held_input_keeps_the_arm_from_being_armed(held: dict[str, Any], says: str) -> None:
    bench = Bench()
    operator = bench.join(2)
    bench.drive(0.2, operator)
    bench.drive(0.12, operator, arm=True, **held)
    assert bench.state in ("disarmed", "stopped")
    assert operator.notice is not None
    assert operator.notice.why == bench.robot.status(bench.now_s).stopped_because == f"not armed: {says}"
    # The second begins when the input rests.
    bench.drive(0.02, operator, emergency_stop=True)
    bench.drive(0.05, operator)
    bench.drive(0.02, operator, arm=True)
    because = bench.robot.status(bench.now_s).stopped_because
    assert because == "not armed: keep all inputs at rest for 0.1 s, then press again"
    bench.arm_it(operator)
    assert bench.robot.status(bench.now_s).stopped_because is None


def test_a_press_too_early_does_not_begin_the_second_anew() -> None:
    bench = Bench()
    operator = bench.join(2)
    bench.drive(0.06, operator)
    bench.drive(0.02, operator, arm=True)
    bench.drive(0.04, operator)
    bench.drive(0.02, operator, arm=True)
    assert bench.state == "armed"
