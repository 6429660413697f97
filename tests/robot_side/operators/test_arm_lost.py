"""An arm that gives no new states, or only old ones, is stopped and disarmed, in virtual time."""

import re
from dataclasses import replace

import pytest

from robot_side.arm.port import ArmState
from robot_side.parts import build_parts
from tests.robot_side.passed_on_arm import PassedOnArm
from tests.robot_side.session_bench import QUICK, Bench


class SlowArm(PassedOnArm):
    silent = False
    late_s = 0.0
    _newest: ArmState | None = None

    def state(self, now_s: float) -> ArmState:
        measured = self.arm.state(now_s)
        if self._newest is None or not self.silent:
            self._newest = replace(measured, time_s=measured.time_s - self.late_s)
        return self._newest


@pytest.fixture
def slow() -> tuple[Bench, SlowArm]:
    parts = build_parts(QUICK, 1, "clock")
    arm = SlowArm(parts.arm)
    return Bench(parts=replace(parts, arm=arm)), arm


def test_a_silent_arm_is_told_to_stand_and_goes_on_when_it_is_back_and_armed_again(slow: tuple[Bench, SlowArm]) -> None:
    bench, arm = slow
    operator = bench.join(2)
    bench.cruise(operator)
    arm.silent = True
    bench.drive(0.1, operator, r2=0.4)
    told = bench.watch.told_to_move
    bench.drive(0.2, operator, r2=0.4)
    assert bench.watch.told_to_move - told <= 1
    assert bench.state == "disarmed"
    because = str(bench.robot.status(bench.now_s).stopped_because)
    assert re.fullmatch(r"arm lost: its newest state is 10[01] ms old", because)
    assert operator.notice is not None
    assert operator.notice.why == "arm lost: nothing new is heard of it"
    with pytest.raises(RuntimeError, match="disarmed"):
        bench.arm_it(operator)
    arm.silent = False
    bench.drive(0.2, operator, r2=0.4)
    assert bench.state == "disarmed"
    bench.cruise(operator)
    assert bench.state == "armed"
    assert len(bench.robot.session.safety.stops) == 1


def test_an_emergency_stop_outlasts_a_lost_arm(slow: tuple[Bench, SlowArm]) -> None:
    bench, arm = slow
    operator = bench.join(2)
    bench.cruise(operator)
    bench.send(operator, emergency_stop=True)
    arm.silent = True
    bench.drive(0.3, operator)
    arm.silent = False
    bench.drive(0.3, operator)
    assert bench.state == "stopped"


def test_a_state_that_is_20_ms_old_adds_20_ms_to_the_loop_and_is_carried_to_now(slow: tuple[Bench, SlowArm]) -> None:
    bench, arm = slow
    operator = bench.join(2)
    bench.drive(5.0, operator)  # Until the assumed loop age has faded.
    age_s = bench.robot.loop_age_s(bench.now_s)
    arm.late_s = 0.02
    bench.cruise(operator)
    assert bench.robot.loop_age_s(bench.now_s) == pytest.approx(age_s + 0.02, abs=0.001)
    measured, newest = bench.robot.parts.arm.state(bench.now_s), bench.robot.newest
    assert newest is not None
    carried_m = newest[1].pose.tool_position_m - bench.robot.parts.kinematics.pose(measured).tool_position_m
    speed_m_s = newest[0].speed_m_s
    assert speed_m_s > 0.02
    assert carried_m[0] == pytest.approx(0.02 * speed_m_s, abs=0.0003)
