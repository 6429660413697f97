"""Estimate of joint and finger positions, by a filter that averages the noise of single readings.

Position readings are noisy; the drives' velocity is less so. The estimate moves with the velocity, and approaches the
readings with a time constant (a complementary filter). It has no lag. With a reading every 4 ms it has about a third of
their noise, with one every millisecond a sixth. The fingers' velocity is not measured, but estimated as well (an α-β
filter).
"""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import ArmState

TIME_CONSTANT_S = 0.02
_LOST_S = 0.1
"""Time without a reading after which the estimate restarts, in seconds."""
_AT_ONCE_S = 2e-3
"""Age, in seconds, up to which a state counts as present: a simulation's state is one step old."""
_LOST = 0.01
"""Distance from a reading, in rad or m, at which the estimate restarts: larger than any noise of a reading."""


def lateness_s(measured: ArmState, now_s: float) -> float:
    """Return the age of a state at `now_s`, in seconds; an age of up to 2 ms counts as 0."""
    age_s = now_s - measured.time_s
    return age_s if age_s > _AT_ONCE_S else 0.0


class JointEstimate:
    """Filter of an arm's joint and finger readings, from one state to the next."""

    def __init__(self) -> None:
        self._last: ArmState | None = None
        self._finger_velocities: FloatArray = np.empty(0)

    def update(self, measured: ArmState) -> ArmState:
        """Return `measured` with estimated positions; a second state with the same time changes nothing."""
        last = self._last
        since_s = math.inf if last is None else measured.time_s - last.time_s
        if last is None or not 0.0 <= since_s < _LOST_S:
            return self._begin(measured)
        if since_s == 0.0:
            return last
        fingers_there = measured.finger_positions.shape == last.finger_positions.shape
        if not (fingers_there and measured.joint_positions_rad.shape == last.joint_positions_rad.shape):
            return self._begin(measured)
        velocities = last.joint_velocities_rad_s + measured.joint_velocities_rad_s
        joints = last.joint_positions_rad + 0.5 * since_s * velocities
        fingers = last.finger_positions + since_s * self._finger_velocities
        joints_off, fingers_off = measured.joint_positions_rad - joints, measured.finger_positions - fingers
        # NaN fails the comparison.
        if not ((np.abs(joints_off) < _LOST).all() and (np.abs(fingers_off) < _LOST).all()):
            return self._begin(measured)
        share = 1.0 - math.exp(-since_s / TIME_CONSTANT_S)
        joints, fingers = joints + share * joints_off, fingers + share * fingers_off
        # Gain of an α-β filter that neither overshoots nor lags behind a steady motion.
        drawn = share * share / (2.0 - share) / since_s
        self._finger_velocities = self._finger_velocities + drawn * fingers_off
        self._last = ArmState(
            measured.time_s,
            joints,
            measured.joint_velocities_rad_s,
            fingers,
            measured.gripper_opening_m,
            measured.gripper_holding,
            measured.joint_loads_nm,
            measured.simulated_s,
        )
        return self._last

    def carried(self, late_s: float) -> ArmState:
        """Return the last state, extrapolated by `late_s` with constant velocities.

        The extrapolation ends at 0.1 s, because an arm that is silent for longer may stand still. ValueError before the
        first `update`.
        """
        last = self._last
        if last is None:
            raise ValueError("no state has been measured yet; valid: a call after the first update")
        if late_s == 0.0:
            return last
        since_s = min(late_s, _LOST_S)
        return ArmState(
            last.time_s,
            last.joint_positions_rad + since_s * last.joint_velocities_rad_s,
            last.joint_velocities_rad_s,
            last.finger_positions + since_s * self._finger_velocities,
            last.gripper_opening_m,
            last.gripper_holding,
            last.joint_loads_nm,
            last.simulated_s,
        )

    def _begin(self, measured: ArmState) -> ArmState:
        self._last, self._finger_velocities = measured, np.zeros_like(measured.finger_positions)
        return measured
