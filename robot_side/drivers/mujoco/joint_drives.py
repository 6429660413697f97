"""Actuator inputs that make joints follow their references, for position servos, velocity servos and motors."""

from dataclasses import dataclass
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.drivers.mujoco.model_enums import BiasKind, JointKind, TransmissionKind

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
"""Record of a joint's drive; for the other fields see `JointDrives`. friction: damping of the joint itself, N m s/rad.
acceleration: commanded acceleration, rad/s². load: torque that this acceleration, friction and gravity need, N m."""

# Bandwidths of the loops that this controller closes; servos of the model have their own stiffness.
_MOTOR_BANDWIDTH_RAD_S = 50.0
_VELOCITY_SERVO_BANDWIDTH_RAD_S = 20.0
_MOST_WINDUP_RAD = 0.02
_MOST_STUCK_RAD = 0.3
_IDLE_BANDWIDTH_RAD_S = 30.0
"""Bandwidth of the servos that hold idle joints driven by motors."""


@dataclass(frozen=True)
class JointDrives:
    """Actuators of the arm's joints, (n,) each: torque = gear (gain u + offset - stiffness l - damping dl/dt).

    Here u is the input and l = gear q the actuator's length: MuJoCo's fixed gain with an affine bias. A position servo
    has stiffness and damping, a velocity servo only damping, a motor neither.
    """

    gear: FloatArray
    gain: FloatArray
    offset: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    strongest: FloatArray
    """Greatest torque in N m, or force in N, of each actuator; infinite without a limit in the model"""

    def windup_rad(self, least_rad: float, dry_friction_nm: FloatArray | float = 0.0) -> FloatArray:
        """Return the largest lead (n,) of each reference over its joint: where a servo gives an eighth of `strongest`.

        The lead is at least least_rad and at most 20 mrad; drives without stiffness, or without a limit, have 20 mrad.
        It is more where a servo needs more, up to 300 mrad, to overcome the joints' dry friction (n,).
        """
        stiffness = self.gear**2 * self.stiffness
        known = (stiffness > 0.0) & np.isfinite(self.strongest)
        pressing = np.divide(self.strongest, 8.0 * stiffness, out=np.full_like(stiffness, np.inf), where=known)
        sticks = np.divide(1.5 * dry_friction_nm, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
        usual = np.clip(pressing, least_rad, max(_MOST_WINDUP_RAD, least_rad))
        windup_rad: FloatArray = np.maximum(usual, np.minimum(sticks, _MOST_STUCK_RAD))
        return windup_rad

    def table(self, friction: FloatArray) -> np.ndarray:
        """Return records (n,) of DRIVE. friction (n,): damping of each joint itself, N m s/rad."""
        drives = np.zeros(self.gear.shape, DRIVE)
        for name in ("gear", "gain", "offset", "stiffness", "damping"):
            drives[name] = getattr(self, name)
        drives["friction"] = friction
        return drives


@inlined
def motor_acceleration(drive: Any, position_error: float, velocity_error: float) -> float:
    """Return the acceleration that a motor's critically damped loop adds to the reference's; 0 for servos.

    The errors are reference minus measurement. The caller multiplies the acceleration by the arm's inertia.
    """
    if drive.stiffness != 0.0 or drive.damping != 0.0:
        return 0.0
    return _MOTOR_BANDWIDTH_RAD_S**2 * position_error + 2.0 * _MOTOR_BANDWIDTH_RAD_S * velocity_error


@inlined
def control(drive: Any, position_error: float, position: float, velocity: float, load: float) -> float:
    """Return the actuator's input u with which the joint follows its reference's `position` and `velocity`.

    position_error: reference minus measurement. load: torque against gravity, friction and inertia, N m; force in N for
    a prismatic joint. A feedforward term cancels a servo's damping, so that a moving servo does not lag.
    """
    if drive.stiffness == 0.0 and drive.damping != 0.0:
        velocity += _VELOCITY_SERVO_BANDWIDTH_RAD_S * position_error
    servo = drive.gear * (drive.stiffness * position + drive.damping * velocity)
    force: float = (load / drive.gear - drive.offset + servo) / drive.gain
    return force


def hold_idle(model: Any, data: Any, busy: IntArray) -> None:
    """Let every actuator on a joint, but those at `busy` (b,), hold its joint where it is, against gravity.

    The forward dynamics of `data` must be known. A servo gets the input at which it rests; another actuator becomes a
    servo, unless it has a state of its own.
    """
    inertia: FloatArray = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    for actuator in np.setdiff1d(np.arange(model.nu), busy).tolist():
        on_joint = model.actuator_trntype[actuator] in (TransmissionKind.JOINT, TransmissionKind.JOINT_IN_PARENT)
        joint, place = int(model.actuator_trnid[actuator, 0]), int(model.actuator_ctrladr[actuator])
        gear = float(model.actuator_gear[actuator, 0])
        if not on_joint or model.jnt_type[joint] < JointKind.SLIDE or model.actuator_dyntype[actuator] or gear == 0.0:
            continue
        velocity = int(model.jnt_dofadr[joint])
        load = (data.qfrc_bias - data.qfrc_passive)[velocity] / gear
        length = float(data.actuator_length[actuator])
        gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
        if bias[1] < 0.0 and gain[0] != 0.0:
            data.ctrl[place] = (load - bias[0] - bias[1] * length) / gain[0]
            continue
        stiffness = inertia[velocity, velocity] * (_IDLE_BANDWIDTH_RAD_S / gear) ** 2
        model.actuator_biastype[actuator] = BiasKind.AFFINE
        bias[:3] = load + stiffness * length, -stiffness, -2.0 * stiffness / _IDLE_BANDWIDTH_RAD_S
        gain[:] = 0.0
