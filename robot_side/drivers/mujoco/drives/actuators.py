"""Actuators that move a model's joints: which ones drive the arm's, and why others cannot."""

from typing import Any, Final, NamedTuple, NoReturn

import numpy as np

from common.arrays import IntArray
from common.errors import ConfigurationError
from robot_side.drivers.mujoco.drives.joint_drives import JointDrives
from robot_side.drivers.mujoco.model_enums import BiasKind, DynamicsKind, GainKind, TransmissionKind, WrappedKind

_ON_JOINT: Final = (TransmissionKind.JOINT, TransmissionKind.JOINT_IN_PARENT)
_CLAMP_OFF: Final = 1 << 8
"""Bit of a model's `disableflags` with which inputs have no limits"""
_POSITION_AND_VELOCITY: Final = 3
"""`actuator_ctrlspec` of a PID actuator whose inputs are a position and a velocity"""
_VALID: Final = "position, velocity, motor, and pid without ki"


class _Input(NamedTuple):
    """Row of `JointDrives`."""

    gear: float
    gain: float
    offset: float
    stiffness: float
    damping: float
    strongest: float
    lowest: float
    highest: float
    joint: int
    place: int


def moves_any(model: Any, actuator: int, joints: IntArray) -> bool:
    """Return whether an actuator moves one of `joints` (n,), directly or by a tendon."""
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    if kind in _ON_JOINT:
        return target in joints
    if kind == TransmissionKind.TENDON:
        first = int(model.tendon_adr[target])
        wrapped = slice(first, first + int(model.tendon_num[target]))
        is_joint = model.wrap_type[wrapped] == WrappedKind.JOINT
        return bool(np.isin(model.wrap_objid[wrapped][is_joint], joints).any())
    return False


def find_drives(model: Any, joints: IntArray, fingers: IntArray) -> JointDrives:
    """Return the inputs of the actuators that drive the arm's `joints` (n,). fingers (f,): the gripper's joints.

    A joint may have several actuators; all that the model enables are driven. ConfigurationError, which names joint and
    actuators, if there is none, or one that would act by itself: of another kind, or by a tendon.
    """
    found: list[_Input] = []
    for number, joint in enumerate(joints.tolist()):
        moving = [one for one in range(model.nactuator) if moves_any(model, one, np.array([joint]))]
        enabled = [one for one in moving if not model.opt.disableactuator >> int(model.actuator_group[one]) & 1]
        own = [one for one in enabled if model.actuator_trntype[one] in _ON_JOINT]
        if not own:
            _refuse_without(model, joint, moving)
        drives = [one for one in own if _can_drive(model, one)]
        acting = [one for one in enabled if one not in drives and not _rests(model, one)]
        acting = [one for one in acting if one in own or not moves_any(model, one, fingers)]
        rows = [row for one in drives for row in _inputs(model, one, number)]
        if acting or not any(row.gain for row in rows):
            _refuse_kind(model, joint, acting or own, own)
        found += rows
    columns = zip(*found, strict=True)
    return JointDrives(**{name: np.array(column) for name, column in zip(_Input._fields, columns, strict=True)})


def joint_name(model: Any, joint: int) -> str:
    """Return a description of the joint by which a person can find it in the model."""
    if name := model.joint(joint).name:
        return f"joint {name!r}"
    body = int(model.jnt_bodyid[joint])
    return f"unnamed joint {joint} of body {model.body(body).name or str(body)!r}"


def _can_drive(model: Any, actuator: int) -> bool:
    """Return whether the actuator's force is gain u + offset - stiffness l - damping dl/dt for each of its inputs."""
    # An internal state between input and force, such as that of an integrator, is not supported.
    fixed = model.actuator_gaintype[actuator] == GainKind.FIXED and model.actuator_ctrlnum[actuator] == 1
    by_two = (
        model.actuator_gaintype[actuator] == GainKind.PID
        and model.actuator_ctrlspec[actuator] == _POSITION_AND_VELOCITY
    )
    return bool(
        (fixed or by_two)
        and model.actuator_dyntype[actuator] == DynamicsKind.NONE
        and model.actuator_biastype[actuator] in (BiasKind.NONE, BiasKind.AFFINE)
        and model.actuator_gear[actuator, 0] != 0.0
        and (model.actuator_biasprm[actuator, 1:3] <= 0.0).all()
    )


def _rests(model: Any, actuator: int) -> bool:
    """Return whether the actuator exerts no force while its inputs are 0, as they are unless something drives it."""
    return bool(
        model.actuator_dyntype[actuator] == DynamicsKind.NONE and model.actuator_biastype[actuator] == BiasKind.NONE
    )


def _inputs(model: Any, actuator: int, joint: int) -> list[_Input]:
    """Return a row for each of the actuator's inputs; joint: number of the arm's joint."""
    gear, place = float(model.actuator_gear[actuator, 0]), int(model.actuator_ctrladr[actuator])
    affine = model.actuator_biastype[actuator] == BiasKind.AFFINE
    offset, stiffness, damping = (model.actuator_biasprm[actuator, :3] * (1.0, -1.0, -1.0) * affine).tolist()
    parts = [(float(model.actuator_gainprm[actuator, 0]), offset, stiffness, damping)]
    if model.actuator_gaintype[actuator] == GainKind.PID:
        parts = [(stiffness, offset, stiffness, 0.0), (damping, 0.0, 0.0, damping)]
    limited = bool(model.actuator_forcelimited[actuator])
    strongest = abs(gear) * float(model.actuator_forcerange[actuator, 1]) if limited else np.inf
    rows = []
    for at, part in enumerate(parts, start=place):
        lowest, highest = -np.inf, np.inf
        if model.actuator_ctrllimited[at] and not model.opt.disableflags & _CLAMP_OFF:
            lowest, highest = model.actuator_ctrlrange[at].tolist()
        rows.append(_Input(gear, *part, strongest, lowest, highest, joint, at))
    return rows


def _refuse_without(model: Any, joint: int, moving: list[int]) -> NoReturn:
    """Raise ConfigurationError for a joint without an enabled actuator of its own; moving: all that move the joint."""
    why = "nothing would hold or move it"
    off = [one for one in moving if model.actuator_trntype[one] in _ON_JOINT]
    if off:
        why = f"the model disables {_names(model, off)} (actuatorgroupdisable)"
    elif moving:
        why = "it shares the tendon that pulls it with another joint"
    elif model.nmocap > 0:
        why = "the model is moved by a mocap body, which no real robot has"
    raise ConfigurationError(
        f"model: the arm's {joint_name(model, joint)} has no actuator of its own: {why};"
        " valid: a position, velocity or motor actuator on each joint from the base to the site"
    )


def _refuse_kind(model: Any, joint: int, wrong: list[int], own: list[int]) -> NoReturn:
    """Raise ConfigurationError for the actuators `wrong` of a joint whose own actuators are `own`."""
    by_tendon = [one for one in wrong if one not in own]
    what = "is of an unsupported kind" if len(wrong) == 1 else "are of an unsupported kind"
    if by_tendon:
        wrong, what = by_tendon, f"acts by a tendon on a joint that {_names(model, own)} drives"
    elif len(own) > len(wrong):
        what += f", beside {_names(model, [one for one in own if one not in wrong])}"
    raise ConfigurationError(f"model: {_names(model, wrong)} of {joint_name(model, joint)} {what}; valid: {_VALID}")


def _names(model: Any, actuators: list[int]) -> str:
    names = " and ".join(repr(model.actuator(one).name or one) for one in actuators)
    return f"the actuator{'s' if len(actuators) > 1 else ''} {names}"
