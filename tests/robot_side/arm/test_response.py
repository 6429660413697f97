"""A simulated arm with limited jerk and latency stops later by what `response_s` says, and never more."""

from typing import cast

import numpy as np
import pytest

from common.errors import ConfigurationError
from robot_side.arm.limits import ArmLimits
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.drivers.remote.connected_drivers import ConnectedDrivers
from robot_side.parts import build_parts, take_limits
from robot_side.settings import RobotSettings

TICK_S = 0.002


def stop_rad(limits: ArmLimits, speed: float) -> float:
    """Turn the first joint at `speed` and then stop it; return its way after that."""
    scene = load_scene()
    arm = MujocoArm(scene, Encoder(0.0, 0.0), limits.of_joints(len(scene.robot.arm_joints)))
    told, began = np.zeros(arm.joint_count), 0.0
    for tick in range(1500):
        now_s = tick * TICK_S
        state = arm.state(now_s)
        told[0] = speed if now_s < 1.2 else 0.0
        if now_s < 1.2:
            began = float(state.joint_positions_rad[0])
            still = abs(float(state.joint_velocities_rad_s[0]) - speed)
        arm.command(told, now_s + 0.1)
    assert still < 0.02
    assert abs(float(arm.state(3.0).joint_velocities_rad_s[0])) < 1e-3
    return float(arm.state(3.0).joint_positions_rad[0]) - began


@pytest.mark.parametrize("jerk", [40.0, 200.0, None])
@pytest.mark.parametrize("speed", [0.3, 0.8])
@pytest.mark.parametrize("latency_s", [0.0, 0.08])
def test_a_stop_takes_what_the_response_says(jerk: float | None, speed: float, latency_s: float) -> None:
    limits = ArmLimits(2.0, 4.0, jerk_rad_s3=jerk, latency_s=latency_s)
    way = stop_rad(limits, speed) - stop_rad(ArmLimits(2.0, 4.0), speed)
    later = speed * limits.of_joints(1).response_s
    assert way <= later + speed * 2.0 * TICK_S
    reaches = jerk is None or speed > 4.0**2 / jerk
    if reaches:  # a ramp too short to reach the acceleration is behind by less
        assert way == pytest.approx(later, abs=speed * 2.0 * TICK_S + 1e-4)


def test_limits_of_another_number_of_joints_are_refused() -> None:
    with pytest.raises(ValueError, match=r"arm\.limits\.velocity_rad_s holds 2 values; valid: one number, or 6"):
        ArmLimits(velocity_rad_s=(1.0, 2.0)).of_joints(6)
    with pytest.raises(ValueError, match="acceleration_rad_s2"):
        ArmLimits(acceleration_rad_s2=-1.0)


def test_what_the_settings_say_counts_before_what_the_driver_says() -> None:
    limits = ArmLimits(velocity_rad_s=1.0).unless_known(ArmLimits((2.0, 3.0), (4.0, 5.0), latency_s=0.1))
    assert limits == ArmLimits(1.0, (4.0, 5.0), latency_s=0.1)


class SaysSlow:
    """Drivers of an arm of which one says a great acceleration."""

    has_arm = True

    def said_limits(self) -> ArmLimits:
        return ArmLimits(acceleration_rad_s2=1000.0)

    def limits_taken(self) -> None:
        raise AssertionError("limits that cannot be must not be taken")


def test_limits_that_only_together_are_too_late_are_told_in_a_line() -> None:
    settings = RobotSettings(arm_limits=ArmLimits(jerk_rad_s3=10.0))
    parts = build_parts(settings, 1, "clock")
    with pytest.raises(ConfigurationError, match="valid: up to 1 s; jerk_rad_s3 from the settings"):
        take_limits(settings, parts, cast(ConnectedDrivers, SaysSlow()))
