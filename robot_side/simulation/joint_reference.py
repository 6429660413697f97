"""Where the joints should be now: a commanded velocity turned into a reference that stops by itself."""

import math
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.ability import JointLimits


@dataclass(frozen=True)
class MotionLimits:
    """What the arm's own controller allows each joint, whatever it is told; metres for a prismatic joint."""

    velocity_rad_s: float = 2.0
    """Under the 3.14 rad/s of a UR5e and the 2.17 rad/s of a Franka arm's large joints (their data sheets)."""
    acceleration_rad_s2: float = 8.0
    deceleration_rad_s2: float = 12.0
    """How fast the reference stops when a command has run out."""
    windup_rad: float = 0.005
    """How far the reference may run ahead of a joint that something holds back, unless the caller says more for weak
    drives. The built-in arm's large joints press with 20 N m then, some 30 N at the tool, and hardly spring when that
    gives way."""

    def __post_init__(self) -> None:
        for name in ("velocity_rad_s", "acceleration_rad_s2", "deceleration_rad_s2", "windup_rad"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value}; valid: finite and above 0")

    def of_joints(
        self, count: int, lower_rad: FloatArray | None = None, upper_rad: FloatArray | None = None
    ) -> JointLimits:
        """The same for each of `count` joints, which end at lower_rad and upper_rad (n,)."""
        velocity, acceleration = np.full(count, self.velocity_rad_s), np.full(count, self.acceleration_rad_s2)
        return JointLimits(velocity, acceleration, lower_rad, upper_rad)


class JointReference:
    """References (n,) for position, velocity and acceleration: they follow a command until it runs out, then stop."""

    def __init__(
        self,
        position_rad: FloatArray,
        lower_rad: FloatArray,
        upper_rad: FloatArray,
        limits: MotionLimits,
        windup_rad: FloatArray | None = None,
    ) -> None:
        """Stand at `position_rad` (n,), between lower_rad and upper_rad (n,), which may be infinite.

        windup_rad (n,): that of each joint, in place of the limits'.
        """
        self.position_rad: FloatArray = np.clip(position_rad, lower_rad, upper_rad)
        self.velocity_rad_s: FloatArray = np.zeros_like(self.position_rad)
        self.acceleration_rad_s2: FloatArray = np.zeros_like(self.position_rad)
        self._lower_rad = lower_rad
        self._upper_rad = upper_rad
        self._limits = limits
        self._windup_rad = np.full(self.position_rad.shape, limits.windup_rad) if windup_rad is None else windup_rad
        self._stopped: FloatArray = np.zeros_like(self.position_rad)
        self._command = self._stopped
        self._valid_until_s = -math.inf
        self._following = False

    def command(self, velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Follow `velocity_rad_s` (n,), scaled as a whole to the limit, until `valid_until_s`.

        ValueError for a wrong shape or a value that is not finite: nothing of it is applied.
        """
        velocity = np.asarray(velocity_rad_s, dtype=np.float64)
        if velocity.shape != self.position_rad.shape:
            raise ValueError(f"joint_velocity_rad_s has the shape {velocity.shape}; valid: {self.position_rad.shape}")
        if not np.isfinite(velocity).all():
            raise ValueError("joint_velocity_rad_s holds NaN or infinity; valid: finite numbers")
        if not math.isfinite(valid_until_s):
            raise ValueError(f"valid_until_s = {valid_until_s}; valid: a finite time")
        excess = float(np.max(np.abs(velocity))) / self._limits.velocity_rad_s
        self._command = velocity / max(excess, 1.0)
        self._valid_until_s = valid_until_s

    def advance(
        self, time_s: float, step_s: float, measured_position_rad: FloatArray, measured_velocity_rad_s: FloatArray
    ) -> None:
        """Move the references on by `step_s` from `time_s`, near the measured positions and velocities (n,)."""
        limits = self._limits
        following = time_s < self._valid_until_s
        if self._following and not following:
            # Halting from a reference that ran ahead would first make the arm catch up with it.
            self.position_rad = measured_position_rad.copy()
            speed = limits.velocity_rad_s
            self.velocity_rad_s = np.clip(measured_velocity_rad_s, -speed, speed)
        self._following = following
        # Near a limit only the speed from which the joint can still stop before it.
        position = self.position_rad
        to_lower = -np.sqrt(2.0 * limits.deceleration_rad_s2 * np.maximum(position - self._lower_rad, 0.0))
        to_upper = np.sqrt(2.0 * limits.deceleration_rad_s2 * np.maximum(self._upper_rad - position, 0.0))
        target = np.clip(self._command, to_lower, to_upper) if following else self._stopped
        change = target - self.velocity_rad_s
        most = (limits.acceleration_rad_s2 if following else limits.deceleration_rad_s2) * step_s
        largest = float(np.abs(change).max())
        if largest > most:
            change *= most / largest
        velocity = np.clip(self.velocity_rad_s + change, to_lower, to_upper)
        self.acceleration_rad_s2 = (velocity - self.velocity_rad_s) / step_s
        self.velocity_rad_s = velocity
        way = velocity * step_s
        moved = np.clip(position + way, self._lower_rad, self._upper_rad)
        # What a load has made of the lead stays: a reference that followed the joint back would let it sink.
        lead = self._windup_rad + np.abs(way)
        self.position_rad = np.clip(
            moved,
            np.minimum(position, measured_position_rad - lead),
            np.maximum(position, measured_position_rad + lead),
        )
