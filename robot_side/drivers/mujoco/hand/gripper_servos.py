"""Position servos in place of a gripper's motors and speed servos, as a gripper's own controller closes that loop."""

import math
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.errors import ConfigurationError
from robot_side.drivers.mujoco.model_enums import BiasKind, DynamicsKind, GainKind, TransmissionKind
from robot_side.drivers.mujoco.robot_model import RobotModel

_FULL_FORCE: Final = 0.3
"""Distance from its goal, as a share of the travel, at which such a servo gives its greatest force"""
_DIRECT: Final = (DynamicsKind.NONE, DynamicsKind.FILTER, DynamicsKind.FILTEREXACT)
"""Dynamics by which an input acts at once, or with a time constant, which the servo keeps"""


def serve_gripper(spec: Any, model: Any, robot: RobotModel) -> bool:
    """Make position servos of the gripper's actuators whose inputs are forces or speeds; return whether there are any.

    spec: the MjSpec of the compiled `model`; it must be compiled again afterwards. ConfigurationError for such an
    actuator whose joints have no ranges.
    """
    found = False
    for actuator in robot.gripper_actuators[model.actuator_ctrllimited[robot.gripper_controls].astype(bool)].tolist():
        gain, bias = float(model.actuator_gainprm[actuator, 0]), model.actuator_biasprm[actuator]
        if model.actuator_biastype[actuator] == BiasKind.NONE:
            bias = np.zeros_like(bias)
        integrates = model.actuator_dyntype[actuator] == DynamicsKind.INTEGRATOR
        takes_force = model.actuator_dyntype[actuator] in _DIRECT and bias[1] == 0.0
        fixed = model.actuator_gaintype[actuator] == GainKind.FIXED and gain != 0.0
        if not fixed or not (takes_force or (integrates and bias[1] < 0.0)):
            continue
        shortest, longest, per_force = _travel(model, actuator)
        if not math.isfinite(longest - shortest):
            named = model.actuator(actuator).name or actuator
            raise ConfigurationError(
                f"model: the gripper's actuator {named!r} takes forces or speeds, and moves joints without a range;"
                " valid: a range for each joint, or a position servo"
            )
        servo, stiffness, damping = spec.actuators[actuator], -float(bias[1]), -float(bias[2])
        if takes_force:
            forces = np.sort(gain * model.actuator_ctrlrange[model.actuator_ctrladr[actuator]])
            if model.actuator_forcelimited[actuator]:
                forces = np.clip(forces, *model.actuator_forcerange[actuator])
            stiffness = float(np.abs(forces).max()) / (_FULL_FORCE * (longest - shortest))
            damping = max(damping, 2.0 * math.sqrt(stiffness / per_force))
            servo.forcelimited, servo.forcerange = True, forces
        servo.actlimited, servo.actrange = False, [0.0, 0.0]
        if integrates:
            servo.dyntype = DynamicsKind.NONE
        servo.gainprm[0], servo.biastype = stiffness, mujoco.mjtBias.mjBIAS_AFFINE
        servo.biasprm[:3] = 0.0, -stiffness, -damping
        # Beyond the travel it presses with its full force at either end.
        beyond = _FULL_FORCE * (longest - shortest)
        servo.ctrllimited, servo.ctrlrange = True, [shortest - beyond, longest + beyond]
        found = True
    return found


def _travel(model: Any, actuator: int) -> tuple[float, float, float]:
    """Return an actuator's least and greatest length, infinite without ranges, and its acceleration per force."""
    target = int(model.actuator_trnid[actuator, 0])
    joints, weights = np.array([target]), np.ones(1)
    if model.actuator_trntype[actuator] == TransmissionKind.TENDON:
        wrapped = slice(model.tendon_adr[target], model.tendon_adr[target] + model.tendon_num[target])
        joints, weights = model.wrap_objid[wrapped], model.wrap_prm[wrapped]
    weights = model.actuator_gear[actuator, 0] * weights
    ranges = np.where(model.jnt_limited[joints, None], model.jnt_range[joints], [-np.inf, np.inf])
    lengths = np.sort(weights[:, None] * ranges, axis=1).sum(axis=0)
    return float(lengths[0]), float(lengths[1]), float(np.linalg.norm(weights) * model.actuator_acc0[actuator])
