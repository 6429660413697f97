"""From a joint reference to what each joint's actuator is told: position servo, velocity servo or motor."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined

DRIVE: Final = np.dtype(
    [
        ("gear", np.float64),
        ("gain", np.float64),
        ("offset", np.float64),
        ("stiffness", np.float64),
        ("damping", np.float64),
        ("friction", np.float64),
        ("acceleration", np.float64),
        ("load", np.float64),
    ]
)
"""One joint's drive, see `JointDrives`. friction: the joint's own damping, N m s/rad. acceleration, rad/s²: what it is
to have; load: the torque, N m, that this takes."""

# The stiffness of what this controller closes itself; servos of the model bring their own.
_MOTOR_BANDWIDTH_RAD_S = 50.0
_VELOCITY_SERVO_BANDWIDTH_RAD_S = 20.0
_MOST_WINDUP_RAD = 0.02


@dataclass(frozen=True)
class JointDrives:
    """One actuator on each arm joint, all (n,): torque = gear (gain u + offset - stiffness l - damping dl/dt).

    Here u is its input and l = gear q its length, which is MuJoCo's fixed gain with an affine bias. A position
    servo has stiffness and damping, a velocity servo only damping, a motor neither.
    """

    gear: FloatArray
    gain: FloatArray
    offset: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    strongest: FloatArray
    """The greatest torque, N m, or force, N, that it gives; infinite where the model does not say"""

    def windup_rad(self, least_rad: float) -> FloatArray:
        """How far a reference may lead each joint (n,): until a servo gives an eighth of what it can.

        No less than least_rad, and at most 20 mrad, which every other drive has.
        """
        stiffness = self.gear**2 * self.stiffness
        known = (stiffness > 0.0) & np.isfinite(self.strongest)
        pressing = np.divide(self.strongest, 8.0 * stiffness, out=np.full_like(stiffness, np.inf), where=known)
        return np.clip(pressing, least_rad, max(_MOST_WINDUP_RAD, least_rad))

    def table(self, friction: FloatArray) -> np.ndarray:
        """(n,) of DRIVE. friction (n,): each joint's own damping, N m s/rad."""
        drives = np.zeros(self.gear.shape, DRIVE)
        for name in ("gear", "gain", "offset", "stiffness", "damping"):
            drives[name] = getattr(self, name)
        drives["friction"] = friction
        return drives


@inlined
def motor_acceleration(drive: Any, position_error: float, velocity_error: float) -> float:
    """The joint acceleration that a motor's critically damped loop adds to its reference's; 0 for servos.

    The errors are reference less measured. The caller multiplies by the arm's inertia.
    """
    if drive.stiffness != 0.0 or drive.damping != 0.0:
        return 0.0
    return _MOTOR_BANDWIDTH_RAD_S**2 * position_error + 2.0 * _MOTOR_BANDWIDTH_RAD_S * velocity_error


@inlined
def control(drive: Any, position_error: float, position: float, velocity: float, load: float) -> float:
    """The actuator's input u under which the joint follows its reference `position` and `velocity`.

    position_error: reference less measured. load: the torque, N m, that holds the joint against gravity, friction and
    its own inertia; force in N for a prismatic joint. A servo is told its reference ahead by what its damping holds
    back, so that it does not lag while it moves.
    """
    if drive.stiffness == 0.0 and drive.damping != 0.0:
        velocity += _VELOCITY_SERVO_BANDWIDTH_RAD_S * position_error
    servo = drive.gear * (drive.stiffness * position + drive.damping * velocity)
    told: float = (load / drive.gear - drive.offset + servo) / drive.gain
    return told
