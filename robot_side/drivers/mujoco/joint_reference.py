"""References of joints that follow a commanded velocity, and stop by themselves when the command expires."""

import math
from collections import deque
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.compiled.kernel import building_block

REFERENCE: Final = np.dtype(
    [
        ("position", np.float64),
        ("velocity", np.float64),
        ("acceleration", np.float64),
        ("measured_position", np.float64),
        ("measured_velocity", np.float64),
        ("command", np.float64),
        ("lower", np.float64),
        ("upper", np.float64),
        ("windup", np.float64),
        ("yields", np.float64),
        ("to_lower", np.float64),
        ("to_upper", np.float64),
        ("change", np.float64),
        ("fastest", np.float64),
        ("accelerates", np.float64),
        ("decelerates", np.float64),
        ("jerk", np.float64),
    ]
)
"""Record of a joint's reference, in rad and s. lower, upper: ends of its range. windup: as for `JointReference`;
yields: its yield_rad. to_lower, to_upper: velocities from
which the joint can still stop at these ends. change: target velocity minus present velocity. fastest, accelerates,
decelerates, jerk: its limits; decelerates after a command has expired."""

WINDUP_RAD: Final = 0.005
"""Largest lead of the reference over a blocked joint, unless weak drives need more. With it the built-in arm's large
joints press with 20 N m, about 30 N at the tool, and hardly spring when the obstacle gives way."""


class JointReference:
    """References (n,) of position, velocity and acceleration: they follow a command until it expires, then stop."""

    def __init__(
        self,
        position_rad: FloatArray,
        lower_rad: FloatArray,
        upper_rad: FloatArray,
        limits: JointLimits,
        windup_rad: FloatArray | float = WINDUP_RAD,
        yield_rad: FloatArray | None = None,
    ) -> None:
        """Begin at `position_rad` (n,), between the ends lower_rad and upper_rad (n,), which may be infinite.

        windup_rad (n,): largest lead of each joint. yield_rad (n,): deviation
        beyond which a joint that is pushed away takes its reference along, as it would spring back; None: never.
        """
        self.joints: np.ndarray = np.zeros(position_rad.shape, REFERENCE)
        """(n,) records of REFERENCE"""
        for name, values in (
            ("position", np.clip(position_rad, lower_rad, upper_rad)),
            ("lower", lower_rad),
            ("upper", upper_rad),
            ("windup", windup_rad),
            ("yields", np.inf if yield_rad is None else yield_rad),
            ("fastest", limits.velocity_rad_s),
            ("accelerates", limits.acceleration_rad_s2),
            ("decelerates", limits.deceleration_rad_s2),
            ("jerk", limits.jerk_rad_s3),
        ):
            self.joints[name] = values
        self._latency_s = limits.latency_s
        self._arrived: list[tuple[FloatArray, float]] = []
        self._late: deque[tuple[float, FloatArray, float]] = deque()
        self._valid_until_s = -math.inf
        self._following = False

    def command(self, velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Follow `velocity_rad_s` (n,) until `valid_until_s`; above the limit, all are scaled by the same factor.

        ValueError for a wrong shape or a value that is not finite; nothing of such a command is applied.
        """
        if velocity_rad_s.shape != self.joints.shape:
            raise ValueError(f"joint_velocity_rad_s has the shape {velocity_rad_s.shape}; valid: {self.joints.shape}")
        if not math.isfinite(valid_until_s):
            raise ValueError(f"valid_until_s = {valid_until_s}; valid: a finite time")
        share = float((np.abs(velocity_rad_s) / self.joints["fastest"]).max(initial=0.0))
        if not math.isfinite(share):
            raise ValueError("joint_velocity_rad_s holds NaN or infinity; valid: finite numbers")
        velocity_rad_s = velocity_rad_s / max(share, 1.0)
        if self._latency_s > 0.0:
            self._arrived.append((velocity_rad_s, valid_until_s))
            return
        self.joints["command"], self._valid_until_s = velocity_rad_s, valid_until_s

    def expire(self) -> None:
        """Forget the command; the next step is not its end."""
        self._valid_until_s, self._following = -math.inf, False
        self._arrived.clear()
        self._late.clear()

    def follows(self, time_s: float) -> tuple[bool, bool]:
        """Return whether there is a command to follow at `time_s`, and whether it has expired since the last call."""
        if self._latency_s > 0.0:  # all that the drive is told takes effect later, the end too
            self._late += [(time_s + self._latency_s, *one) for one in self._arrived]
            self._arrived.clear()
            while self._late and self._late[0][0] <= time_s:
                _, self.joints["command"], until_s = self._late.popleft()
                self._valid_until_s = until_s + self._latency_s
        before, self._following = self._following, time_s < self._valid_until_s
        return self._following, before and not self._following


@building_block
def advance_references(
    joints: Any,
    following: bool,
    ended: bool,
    step_s: float,
) -> None:
    """Advance the references of all `joints` by `step_s`; they stay near the measured positions.

    All changes of velocity are scaled by the same factor, so that each is within its limit. ended: whether the command
    has just expired.
    """
    share = 1.0
    for j in range(joints.size):
        joint = joints[j]
        if ended:
            # A stop from a reference that leads would first let the arm catch up with it.
            joint.position = joint.measured_position
            joint.velocity = min(max(joint.measured_velocity, -joint.fastest), joint.fastest)
        # Near an end, limit the speed so that the joint can still stop before it.
        joint.to_lower = -math.sqrt(2.0 * joint.decelerates * max(joint.position - joint.lower, 0.0))
        joint.to_upper = math.sqrt(2.0 * joint.decelerates * max(joint.upper - joint.position, 0.0))
        target = min(max(joint.command, joint.to_lower), joint.to_upper) if following else 0.0
        joint.change = target - joint.velocity
        most = (joint.accelerates if following else joint.decelerates) * step_s
        if abs(joint.change) > most:
            share = min(share, most / abs(joint.change))
    for j in range(joints.size):
        joint = joints[j]
        changed = joint.change * share
        if joint.jerk < math.inf:
            # The fastest way to a velocity ends at it with no acceleration left: a² = 2 j |Δv| from there on.
            most = math.sqrt(2.0 * joint.jerk * abs(joint.change)) * step_s
            before, step = joint.acceleration * step_s, joint.jerk * step_s * step_s
            changed = min(max(min(max(changed, -most), most), before - step), before + step)
        velocity = min(max(joint.velocity + changed, joint.to_lower), joint.to_upper)
        joint.acceleration = (velocity - joint.velocity) / step_s
        joint.velocity = velocity
        way = velocity * step_s
        moved = min(max(joint.position + way, joint.lower), joint.upper)
        # A lead caused by a load stays: a reference that followed the joint back would let it sink.
        lead = joint.windup + abs(way)
        most = max(lead, joint.yields)
        most_behind = max(min(joint.position, joint.measured_position - lead), joint.measured_position - most)
        most_ahead = min(max(joint.position, joint.measured_position + lead), joint.measured_position + most)
        joint.position = min(max(moved, most_behind), most_ahead)
