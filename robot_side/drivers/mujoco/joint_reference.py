"""References of joints that follow a commanded velocity, and stop by themselves when the command expires."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
from msgspec import Meta

from common.arrays import BoolArray, FloatArray
from common.limits import check_limits
from robot_side.arm.ability import JointLimits
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
    ]
)
"""Record of a joint's reference, in rad and s. lower, upper: ends of its range. windup: as for `JointReference`;
yields: its yield_rad. to_lower, to_upper: velocities from
which the joint can still stop at these ends. change: target velocity minus present velocity."""

_Limit = Annotated[float, Meta(gt=0.0)]


@dataclass(frozen=True)
class MotionLimits:
    """Limits of each joint in the arm's own controller, for any command; in metres for a prismatic joint."""

    velocity_rad_s: _Limit = 2.0
    """Largest velocity, below the 3.14 rad/s of a UR5e and the 2.17 rad/s of a Franka arm's large joints
    (data sheets)"""
    acceleration_rad_s2: _Limit = 8.0
    deceleration_rad_s2: _Limit = 12.0
    """Deceleration of the reference after a command has expired."""
    windup_rad: _Limit = 0.005
    """Largest lead of the reference over a blocked joint, unless the caller allows more for weak drives. With it the
    built-in arm's large joints press with 20 N m, about 30 N at the tool, and hardly spring when the obstacle gives
    way."""

    def __post_init__(self) -> None:
        check_limits(self)

    def of_joints(
        self,
        count: int,
        lower_rad: FloatArray | None = None,
        upper_rad: FloatArray | None = None,
        slides: BoolArray | bool = False,
    ) -> JointLimits:
        """Return these limits for `count` joints (n); the other arguments are as in `JointLimits`."""
        velocity, acceleration = np.full(count, self.velocity_rad_s), np.full(count, self.acceleration_rad_s2)
        return JointLimits(velocity, acceleration, lower_rad, upper_rad, slides)


class JointReference:
    """References (n,) of position, velocity and acceleration: they follow a command until it expires, then stop."""

    def __init__(
        self,
        position_rad: FloatArray,
        lower_rad: FloatArray,
        upper_rad: FloatArray,
        limits: MotionLimits,
        windup_rad: FloatArray | None = None,
        yield_rad: FloatArray | None = None,
    ) -> None:
        """Begin at `position_rad` (n,), between the ends lower_rad and upper_rad (n,), which may be infinite.

        windup_rad (n,): largest lead of each joint; None: the value of `limits` for all. yield_rad (n,): deviation
        beyond which a joint that is pushed away takes its reference along, as it would spring back; None: never.
        """
        self.joints: np.ndarray = np.zeros(position_rad.shape, REFERENCE)
        """(n,) records of REFERENCE"""
        for name, values in (
            ("position", np.clip(position_rad, lower_rad, upper_rad)),
            ("lower", lower_rad),
            ("upper", upper_rad),
            ("windup", limits.windup_rad if windup_rad is None else windup_rad),
            ("yields", np.inf if yield_rad is None else yield_rad),
        ):
            self.joints[name] = values
        self.limits = limits
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
        largest = float(np.abs(velocity_rad_s).max(initial=0.0))
        if not math.isfinite(largest):
            raise ValueError("joint_velocity_rad_s holds NaN or infinity; valid: finite numbers")
        self.joints["command"] = velocity_rad_s / max(largest / self.limits.velocity_rad_s, 1.0)
        self._valid_until_s = valid_until_s

    def expire(self) -> None:
        """Forget the command; the next step is not its end."""
        self._valid_until_s, self._following = -math.inf, False

    def follows(self, time_s: float) -> tuple[bool, bool]:
        """Return whether there is a command to follow at `time_s`, and whether it has expired since the last call."""
        before, self._following = self._following, time_s < self._valid_until_s
        return self._following, before and not self._following


@building_block
def advance_references(
    joints: Any,
    following: bool,
    ended: bool,
    step_s: float,
    fastest: float,
    acceleration: float,
    deceleration: float,
) -> None:
    """Advance the references of all `joints` by `step_s`; they stay near the measured positions.

    All changes of velocity are scaled by the same factor, so that the largest is within the limit. ended: whether the
    command has just expired.
    """
    largest = 0.0
    for j in range(joints.size):
        joint = joints[j]
        if ended:
            # A stop from a reference that leads would first let the arm catch up with it.
            joint.position = joint.measured_position
            joint.velocity = min(max(joint.measured_velocity, -fastest), fastest)
        # Near an end, limit the speed so that the joint can still stop before it.
        joint.to_lower = -math.sqrt(2.0 * deceleration * max(joint.position - joint.lower, 0.0))
        joint.to_upper = math.sqrt(2.0 * deceleration * max(joint.upper - joint.position, 0.0))
        target = min(max(joint.command, joint.to_lower), joint.to_upper) if following else 0.0
        joint.change = target - joint.velocity
        largest = max(largest, abs(joint.change))
    most = (acceleration if following else deceleration) * step_s
    share = most / largest if largest > most else 1.0
    for j in range(joints.size):
        joint = joints[j]
        velocity = min(max(joint.velocity + joint.change * share, joint.to_lower), joint.to_upper)
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
