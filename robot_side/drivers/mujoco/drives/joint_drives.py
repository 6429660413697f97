"""Actuator inputs that make joints follow their references, for position servos, velocity servos and motors."""

from dataclasses import dataclass
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.drivers.mujoco.model_enums import BiasKind, JointKind, TransmissionKind

DRIVE: Final = np.dtype(
    [(name, np.float64) for name in ("stiffness", "damping", "friction", "dry", "acceleration", "load")],
)
"""Record of a joint's drive, by all of its actuators together. stiffness, damping: torque for each rad, and for each
rad/s. friction: damping of the joint itself, N m s/rad. dry: dry friction of a joint with motors only, N m.
acceleration: commanded acceleration, rad/s². load: torque that this acceleration, friction and gravity need, N m, less
what actuators already give."""
_MODELLED: Final = ("gear", "gain", "offset", "stiffness", "damping", "lowest", "highest")
INPUT: Final = np.dtype(
    [*((name, np.int64) for name in ("joint", "place")), *((name, np.float64) for name in (*_MODELLED, "share"))]
)
"""Record of an input; for the other fields see `JointDrives`. share: part that it takes of what the joint's inputs
before it have left of the load; 1 for the last and strongest."""

# Bandwidths of the loops that this controller closes; servos of the model have their own stiffness.
_MOTOR_BANDWIDTH_RAD_S = 50.0
_VELOCITY_SERVO_BANDWIDTH_RAD_S = 20.0
_MOST_WINDUP_RAD = 0.02
_DRY_LEAD_RAD = 0.01
"""Lead over a joint from which its motor is given all the torque against dry friction"""
_MOST_STUCK_RAD = 0.3
_IDLE_BANDWIDTH_RAD_S = 30.0
"""Bandwidth of the servos that hold idle joints driven by motors."""


@inlined
def motor_acceleration(drive: Any, position_error: float, velocity_error: float) -> float:
    """Return the acceleration that a motor's critically damped loop adds to the reference's; 0 for servos.

    The errors are reference minus measurement. The caller multiplies the acceleration by the arm's inertia.
    """
    if drive.stiffness != 0.0 or drive.damping != 0.0:
        return 0.0
    return _MOTOR_BANDWIDTH_RAD_S**2 * position_error + 2.0 * _MOTOR_BANDWIDTH_RAD_S * velocity_error


@inlined
def friction_torque(drive: Any, velocity: float, position_error: float) -> float:
    """Return the torque against the joint's own friction at the reference's `velocity`, N m.

    position_error: reference minus measurement; all of the dry friction is overcome once the joint is behind.
    """
    dry = drive.dry * min(max(position_error / _DRY_LEAD_RAD, -1.0), 1.0)
    torque: float = drive.friction * velocity + dry
    return torque


@inlined
def servo_velocity(drive: Any, position_error: float, velocity: float) -> float:
    """Return the velocity for a joint's servos: the reference's, and without stiffness what corrects its position."""
    if drive.stiffness == 0.0 and drive.damping != 0.0:
        return velocity + _VELOCITY_SERVO_BANDWIDTH_RAD_S * position_error
    return velocity


@inlined
def control(own: Any, position: float, velocity: float, load: float) -> tuple[float, float]:
    """Return the value u of an input with which its joint follows `position` and `velocity`, and the load that is left.

    load: torque against gravity, friction and inertia that the joint's inputs have still to give, N m; N for a
    prismatic joint. A feedforward term cancels a servo's damping, so that a moving servo does not lag.
    """
    servo, value = own.gear * (own.stiffness * position + own.damping * velocity), 0.0
    if own.gain != 0.0:
        value = min(max((own.share * load / own.gear - own.offset + servo) / own.gain, own.lowest), own.highest)
    return value, load - own.gear * (own.gain * value + own.offset - servo)


@dataclass(frozen=True)
class JointDrives:
    """Inputs of the arm's joints, (k,) each: torque = gear (gain u + offset - stiffness l - damping dl/dt).

    Here u is the input and l = gear q the actuator's length: MuJoCo's fixed gain with an affine bias. A position servo
    has stiffness and damping, a velocity servo only damping, a motor neither; a PID actuator counts as the first two.
    A joint may have several, whose torques add up: each follows the reference, and they share the joint's load.
    """

    gear: FloatArray
    gain: FloatArray
    """Force for each unit of the input; 0 for what is only a spring or a damper"""
    offset: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    strongest: FloatArray
    """Greatest torque in N m, or force in N, of each actuator; infinite without a limit in the model"""
    lowest: FloatArray
    """Least value of each input, `highest` the greatest; infinite without a limit"""
    highest: FloatArray
    joint: IntArray
    """Number of each input's joint, in rising order from 0"""
    place: IntArray
    """Index of each input in ctrl"""

    def windup_rad(self, least_rad: float, dry_friction_nm: FloatArray | float = 0.0) -> FloatArray:
        """Return the largest lead (n,) of each reference over its joint: where a servo gives an eighth of `strongest`.

        The lead is at least least_rad and at most 20 mrad; drives without stiffness, or without a limit, have 20 mrad.
        It is more where a servo needs more, up to 300 mrad, to overcome the joints' dry friction (n,).
        """
        stiffness = self._of_joints(self.gear**2 * self.stiffness)
        strongest = self._of_joints(np.where(self.stiffness > 0.0, self.strongest, 0.0))
        known = (stiffness > 0.0) & np.isfinite(strongest)
        pressing = np.divide(strongest, 8.0 * stiffness, out=np.full_like(stiffness, np.inf), where=known)
        sticks = np.divide(1.5 * dry_friction_nm, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
        usual = np.clip(pressing, least_rad, max(_MOST_WINDUP_RAD, least_rad))
        windup_rad: FloatArray = np.maximum(usual, np.minimum(sticks, _MOST_STUCK_RAD))
        return windup_rad

    def yield_rad(self) -> FloatArray:
        """Return the deviations (n,) of joints from their references at which their servos are at their strongest.

        Infinite without a limit in the model, and without stiffness.
        """
        stiffness, strongest = self._of_joints(self.gear**2 * self.stiffness), self._of_joints(self.strongest)
        return np.divide(strongest, stiffness, out=np.full_like(stiffness, np.inf), where=stiffness > 0.0)

    def table(self, friction: FloatArray, dry_friction_nm: FloatArray | float = 0.0) -> np.ndarray:
        """Return records (n,) of DRIVE. friction (n,), dry_friction_nm (n,): damping and dry friction of the joints."""
        drives = np.zeros(friction.shape, DRIVE)
        drives["stiffness"] = self._of_joints(self.gear**2 * self.stiffness)
        drives["damping"] = self._of_joints(self.gear**2 * self.damping)
        drives["friction"] = friction
        # A servo overcomes dry friction by its stiffness (`windup_rad`).
        drives["dry"] = np.where((drives["stiffness"] == 0.0) & (drives["damping"] == 0.0), dry_friction_nm, 0.0)
        return drives

    def inputs(self) -> np.ndarray:
        """Return records (k,) of INPUT, each joint's weakest first."""
        table = np.zeros(self.gear.shape, INPUT)
        for name in ("joint", "place", *_MODELLED):
            table[name] = getattr(self, name)
        widest = np.maximum(np.abs(self.lowest), np.abs(self.highest))
        able = np.zeros(self.gear.shape)
        np.multiply(np.abs(self.gear * self.gain), widest, out=able, where=self.gain != 0.0)
        able = np.minimum(able, self.strongest)
        order = np.lexsort((able, self.joint))
        table, able = table[order], able[order]
        for joint in range(int(self.joint[-1]) + 1):
            mine = able[table["joint"] == joint]
            mine = np.where(np.isinf(mine), 1.0, 0.0) if np.isinf(mine).any() else mine
            left = np.cumsum(mine[::-1])[::-1]
            share = np.divide(mine, left, out=np.ones_like(mine), where=left > 0.0)
            share[-1] = 1.0
            table["share"][table["joint"] == joint] = share
        return table

    def _of_joints(self, values: FloatArray) -> FloatArray:
        """Return the sum (n,) of the values (k,) of each joint's actuators."""
        sums: FloatArray = np.bincount(self.joint, values).astype(np.float64)
        return sums


def hold_idle(model: Any, data: Any, busy: IntArray) -> None:
    """Let every actuator on a joint, but those at `busy` (b,), hold its joint where it is, against gravity.

    The forward dynamics of `data` must be known. A servo gets the input at which it rests; another actuator becomes a
    servo, unless it has a state of its own.
    """
    inertia: FloatArray = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    borne = set()
    for actuator in np.setdiff1d(np.arange(model.nactuator), busy).tolist():
        on_joint = model.actuator_trntype[actuator] in (TransmissionKind.JOINT, TransmissionKind.JOINT_IN_PARENT)
        joint, place = int(model.actuator_trnid[actuator, 0]), int(model.actuator_ctrladr[actuator])
        gear = float(model.actuator_gear[actuator, 0])
        if not on_joint or model.jnt_type[joint] < JointKind.SLIDE or model.actuator_dyntype[actuator] or gear == 0.0:
            continue
        velocity = int(model.jnt_dofadr[joint])
        # Of several actuators on a joint, the first one bears it.
        load = 0.0 if joint in borne else (data.qfrc_bias - data.qfrc_passive)[velocity] / gear
        borne.add(joint)
        length = float(data.actuator_length[actuator])
        gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
        if bias[1] < 0.0 and gain[0] != 0.0:
            data.ctrl[place] = (load - bias[0] - bias[1] * length) / gain[0]
            continue
        stiffness = inertia[velocity, velocity] * (_IDLE_BANDWIDTH_RAD_S / gear) ** 2
        model.actuator_biastype[actuator] = BiasKind.AFFINE
        bias[:3] = load + stiffness * length, -stiffness, -2.0 * stiffness / _IDLE_BANDWIDTH_RAD_S
        gain[:] = 0.0
