"""Where the joints and fingers are, by more than their last readings: the noise of single ones is averaged out.

A reading says where a joint is, with noise; the drive's velocity says how it has moved since, with little. So the
estimate moves with the velocity, and is drawn to the readings over a time constant (a complementary filter): no lag,
and about a sixth of the noise at 1 kHz. The fingers' velocity is not measured: it is estimated, too (an α-β filter).
"""

import math
from dataclasses import replace

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import ArmState

TIME_CONSTANT_S = 0.02
_LOST_S = 0.1
"""After so long without a reading, the estimate begins anew."""
_LOST = 0.01
"""So far from a reading, too, in rad or m: something else than noise has happened."""


class JointEstimate:
    """Filters what an arm measures of its joints and fingers; it holds from one state to the next."""

    def __init__(self, time_constant_s: float = TIME_CONSTANT_S) -> None:
        """ValueError unless the time constant is finite and above 0."""
        if not (math.isfinite(time_constant_s) and time_constant_s > 0.0):
            raise ValueError(f"time_constant_s = {time_constant_s}; valid: finite and above 0")
        self._time_constant_s = time_constant_s
        self._last: ArmState | None = None
        self._finger_velocities: FloatArray = np.empty(0)

    def update(self, measured: ArmState) -> ArmState:
        """`measured` with estimated positions; a state that was seen already changes nothing."""
        last = self._last
        since_s = math.inf if last is None else measured.time_s - last.time_s
        if last is None or not 0.0 <= since_s < _LOST_S:
            return self._begin(measured)
        if since_s == 0.0:
            return last
        joints = last.joint_positions_rad + 0.5 * since_s * (
            last.joint_velocities_rad_s + measured.joint_velocities_rad_s
        )
        fingers = last.finger_positions + since_s * self._finger_velocities
        off, fingers_off = measured.joint_positions_rad - joints, measured.finger_positions - fingers
        if not max(np.abs(off).max(initial=0.0), np.abs(fingers_off).max(initial=0.0)) < _LOST:
            return self._begin(measured)
        share = 1.0 - math.exp(-since_s / self._time_constant_s)
        # Of an α-β filter that neither overshoots nor lags behind a steady motion.
        self._finger_velocities = self._finger_velocities + share * share / (2.0 - share) / since_s * fingers_off
        self._last = replace(
            measured, joint_positions_rad=joints + share * off, finger_positions=fingers + share * fingers_off
        )
        return self._last

    def _begin(self, measured: ArmState) -> ArmState:
        self._last, self._finger_velocities = measured, np.zeros_like(measured.finger_positions)
        return measured
