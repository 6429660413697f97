"""An arm whose driver's states cannot be true is disarmed, and the operator reads which joint, value and limit."""

from dataclasses import replace

import pytest

from robot_side.arm.port import ArmState
from robot_side.parts import build_parts
from tests.robot_side.passed_on_arm import PassedOnArm
from tests.robot_side.session_bench import QUICK, Bench

DOUBT = "the driver's states cannot be true: joint 1 (elbow): velocity = 1e+06 rad/s; valid: up to 4 rad/s"


class DoubtedArm(PassedOnArm):
    doubt: str | None = None

    def state(self, now_s: float) -> ArmState:
        return replace(self.arm.state(now_s), doubt=self.doubt)


def test_doubted_states_disarm_and_the_operator_reads_why() -> None:
    parts = build_parts(QUICK, 1, "clock")
    arm = DoubtedArm(parts.arm)
    bench = Bench(parts=replace(parts, arm=arm))
    operator = bench.join(2)
    bench.cruise(operator)
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
