"""An arm whose driver's states cannot be true is disarmed, and the operator reads which joint, value and limit."""

from dataclasses import replace

import numpy as np
import pytest

from robot_side.arm.limits import ArmLimits
from robot_side.arm.port import ArmState
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from tests.robot_side.passed_on_arm import PassedOnArm
from tests.robot_side.session_bench import QUICK, Bench, Operator

DOUBT = "the driver's states cannot be true: joint 1 (elbow): velocity = 1e+06 rad/s; valid: up to 4 rad/s"


class DoubtedArm(PassedOnArm):
    doubt: str | None = None
    condition: str | None = None
    load_nm: float | None = None
    blind = False

    def state(self, now_s: float) -> ArmState:
        state = replace(self.arm.state(now_s), doubt=self.doubt, condition=self.condition)
        if self.blind:
            return replace(state, joint_loads_nm=None)
        return state if self.load_nm is None else replace(state, joint_loads_nm=np.full(self.joint_count, self.load_nm))


def cruising(settings: RobotSettings = QUICK) -> tuple[DoubtedArm, Bench, Operator]:
    parts = build_parts(settings, 1, "clock")
    arm = DoubtedArm(parts.arm)
    bench = Bench(parts=replace(parts, arm=arm))
    operator = bench.join(2)
    bench.cruise(operator)
    return arm, bench, operator


def test_doubted_states_disarm_and_the_operator_reads_why() -> None:
    arm, bench, operator = cruising()
    arm.doubt = DOUBT
    told = bench.watch.told_to_move
    bench.drive(0.12, operator, r2=0.4)
    assert bench.watch.told_to_move == told
    assert bench.robot.status(bench.now_s).stopped_because == DOUBT
    assert operator.notice is not None
    assert operator.notice.why == DOUBT
    with pytest.raises(RuntimeError, match="disarmed"):
        bench.arm_it(operator)
    arm.doubt = None
    bench.cruise(operator)
    assert [reason for _, reason in bench.robot.session.safety.stops] == [DOUBT]


def test_an_arms_own_stop_is_latched_and_has_to_be_cleared_twice() -> None:
    """The arm's controller has to be ready again, and then the operator has to arm on purpose."""
    arm, bench, operator = cruising()
    arm.condition = "the arm is in a protective stop: joint 4 met something"
    told = bench.watch.told_to_move
    bench.drive(0.12, operator, r2=0.4)
    assert bench.watch.told_to_move == told
    status = bench.robot.status(bench.now_s)
    assert (status.state, status.stopped_because) == ("stopped", arm.condition)
    assert operator.notice is not None
    assert operator.notice.why == arm.condition
    with pytest.raises(RuntimeError, match="stopped"):
        bench.arm_it(operator)
    arm.condition = None
    bench.drive(2.0, operator)
    assert bench.robot.session.safety.state == "stopped"
    bench.cruise(operator)
    # The refused arming is told meanwhile, and counts as no stop.
    assert len(bench.robot.session.safety.stops) == 1


def test_a_load_over_its_limit_stops_the_arm_which_may_then_be_driven_away() -> None:
    arm, bench, operator = cruising(replace(QUICK, arm_limits=ArmLimits(load_nm=20.0)))
    arm.load_nm = 19.0
    bench.drive(0.2, operator, r2=0.4)
    assert bench.robot.session.safety.state == "armed"
    arm.load_nm = 25.0
    bench.drive(0.2, operator, r2=0.4)
    why = bench.robot.status(bench.now_s).stopped_because or ""
    assert "bears 25.0 N m; its limit is 20.0 N m" in why
    # It presses on. To be freed it has to move, but not to press harder.
    bench.arm_it(operator)
    bench.drive(0.2, operator, l2=0.4)
    assert bench.robot.session.safety.state == "armed"
    stops = len(bench.robot.session.safety.stops)
    arm.load_nm = 30.0
    bench.drive(0.2, operator, l2=0.4)
    assert len(bench.robot.session.safety.stops) == stops + 1


def test_a_load_limit_without_loads_lets_nobody_drive() -> None:
    arm, bench, operator = cruising(replace(QUICK, arm_limits=ArmLimits(load_nm=200.0)))
    arm.blind = True
    bench.drive(0.1, operator, r2=0.4)
    status = bench.robot.status(bench.now_s)
    assert (status.state, status.stopped_because) == (
        "disarmed",
        "load_nm is set, and the driver sends no joint_loads",
    )
