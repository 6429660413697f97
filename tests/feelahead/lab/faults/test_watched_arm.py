"""The instrument of the fault table: it has to see a deceleration when it begins, and none where there is none."""

import numpy as np
import pytest

from common.arrays import FloatArray
from feelahead.lab.faults.watched_arm import WatchedArm
from robot_side.arm.port import ArmState
from robot_side.simulation.joint_reference import MotionLimits

GAP_S = 0.1
DECELERATION_RAD_S2 = MotionLimits().deceleration_rad_s2


class EvenArm:
    """Moves evenly until `slows_s`, then decelerates at the limit."""

    joint_count = 2

    def __init__(self, speed_rad_s: float, slows_s: float, drift_rad_s2: float = 0.0) -> None:
        self.speed_rad_s, self.slows_s, self.drift_rad_s2 = speed_rad_s, slows_s, drift_rad_s2

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        del joint_velocity_rad_s, valid_until_s

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        del closing, valid_until_s

    def state(self, now_s: float) -> ArmState:
        lost = DECELERATION_RAD_S2 * max(0.0, now_s - self.slows_s)
        speed = max(0.0, self.speed_rad_s + self.drift_rad_s2 * now_s - lost)
        velocities = np.array([-speed, 0.5 * speed])
        return ArmState(now_s, np.zeros(2), velocities, np.zeros(0), 0.0, False)


def watch(arm: EvenArm, period_s: float, duration_s: float = 0.5) -> WatchedArm:
    watched = WatchedArm(arm, GAP_S)
    watched.command(np.array([0.3, 0.0]), 0.2 + GAP_S)
    for step in range(1, round(duration_s / period_s) + 1):
        watched.state(step * period_s)
    return watched


@pytest.mark.parametrize("period_s", [0.001, 0.0013, 0.01, 0.05])
@pytest.mark.parametrize("speed_rad_s", [0.1, 0.27, 1.0])
def test_it_sees_when_the_deceleration_began_however_seldom_it_is_asked(period_s: float, speed_rad_s: float) -> None:
    [seen] = watch(EvenArm(speed_rad_s, slows_s=0.3), period_s).decelerations
    assert seen.time_s == pytest.approx(0.3, abs=5e-4)
    assert seen.after_s == pytest.approx(0.1, abs=5e-4)


@pytest.mark.parametrize("drift_rad_s2", [-0.2, 0.0, 0.5])
def test_a_speed_that_changes_slowly_is_no_deceleration(drift_rad_s2: float) -> None:
    assert not watch(EvenArm(0.3, slows_s=9.0, drift_rad_s2=drift_rad_s2), 0.001).decelerations


def test_an_arm_that_stands_does_not_decelerate() -> None:
    assert not watch(EvenArm(0.02, slows_s=0.3), 0.001).decelerations


def test_what_it_is_told_is_counted() -> None:
    watched = WatchedArm(EvenArm(0.0, 9.0), GAP_S)
    watched.command(np.zeros(2), 1.0)
    watched.command(np.array([0.0, 0.1]), 1.0)
    watched.command(np.array([np.nan, 0.1]), 1.0)
    assert (watched.told_to_move, watched.not_finite) == (2, 1)
