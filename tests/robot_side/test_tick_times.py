"""Timing the physics of a tick does not change what the robot side does."""

import numpy as np
import pytest

from common.statistics import microseconds
from robot_side.core.robot_side import RobotSide
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.tick_times import PhysicsTime
from tests.robot_side.drivers.mujoco.test_arm import SlowMachine


def test_a_timed_core_sends_what_a_plain_one_does_and_its_physics_are_timed() -> None:
    physics = PhysicsTime(SlowMachine(1e-6), 0)
    plain, timed = (build_parts(RobotSettings(), 1, "clock") for _ in range(2))
    without, with_times = RobotSide(plain), RobotSide(timed, [physics])
    for turn in range(30):
        now_s = 1.0 + 1e-3 * turn
        assert with_times.tick(now_s) == without.tick(now_s)
    assert with_times.summary() == without.summary()
    assert np.array_equal(timed.scene.data.qpos, plain.scene.data.qpos)
    assert physics.took.count == 30
    assert microseconds(physics.took) == pytest.approx({"p50": 1.0, "p99": 1.0, "max": 1.0})
