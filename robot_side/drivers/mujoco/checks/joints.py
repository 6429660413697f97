"""Check of a model's joints: what is held, what can hardly move, and whether the fingers can span the target."""

import math
from itertools import combinations
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.roles import Role
from robot_side.drivers.mujoco.drives.actuators import moves_any
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel
from robot_side.drivers.mujoco.mesh_arrays import geom_points
from robot_side.drivers.mujoco.model_enums import JointKind
from robot_side.drivers.mujoco.scene import Scene

_NEAR_END: Final = math.radians(2.0)
_SAME: Final = 0.02
_OUTSIDE: Final = 1e-3
"""Least distance from a range, in rad or m, at which a joint starts outside it"""
_NAMED: Final = 4
_FILLS_M: Final = 0.01
"""Depth of a hand's part inside another one from which there may be no gap between them"""
_TIPS_M: Final = 0.03
"""Distance from the hand's end within which its parts are at the fingertips"""


def joint_findings(scene: Scene, travel: GripperTravel | None) -> list[str]:
    """Return a line for each kind of joints that do not move as a person may expect."""
    model, robot = scene.model, scene.robot
    busy = {*robot.arm_joints.tolist(), *_joints_at(model, robot.finger_positions)}
    own = [joint for joint in range(model.njnt) if model.body_rootid[model.jnt_bodyid[joint]] == robot.root_body]
    held = [_name(model, joint) for joint in own if joint not in busy and _driven(model, joint)]
    loose = [_name(model, joint) for joint in own if joint not in busy and not _driven(model, joint)]
    at = scene.data.qpos[robot.arm_positions]
    near = (at - robot.lower_rad < _NEAR_END) | (robot.upper_rad - at < _NEAR_END)
    outside = [_name(model, joint) for joint in own if _is_outside(scene, joint)]
    stuck = [name for joint in robot.arm_joints[near] if (name := _name(model, int(joint))) not in outside]
    dead = _dead(scene)
    lines = (
        (held, "held where they start, as they do not move the tool"),
        (loose, "without an actuator, so that they move freely"),
        (outside, "start outside their ranges"),
        (stuck, "start at an end of their ranges, and move only one way"),
        (_weak(scene), "sink from the start: their actuators are too weak to hold them there"),
        (dead, "turn farther than their actuators' ctrlrange lets them: the rest of their ranges is dead"),
    )
    found = [f"joints {_few(names)}: {what}" for names, what in lines if names]
    return found + _grip(scene, travel)


def _dead(scene: Scene) -> list[str]:
    """Return the joints of position servos whose inputs do not cover the joints' ranges."""
    robot, drives = scene.robot, scene.robot.drives
    names = []
    for row in np.flatnonzero((drives.stiffness > 0.0) & (drives.gain != 0.0)).tolist():
        joint = int(drives.joint[row])
        lower, upper = float(robot.lower_rad[joint]), float(robot.upper_rad[joint])
        scale = drives.gain[row] / (drives.stiffness[row] * drives.gear[row])
        low, high = sorted((scale * drives.lowest[row], scale * drives.highest[row]))
        if math.isfinite(upper - lower) and (low > lower + _SAME or high < upper - _SAME):
            names.append(_name(scene.model, int(robot.arm_joints[joint])))
    return names


def _weak(scene: Scene) -> list[str]:
    """Return the arm's joints whose actuators, at any input, do not give what holds them at the start."""
    model, robot, drives = scene.model, scene.robot, scene.robot.drives
    data = mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    mujoco.mj_forward(model, data)
    needed = (data.qfrc_bias - data.qfrc_passive)[robot.arm_velocities]
    sprung = drives.offset - drives.stiffness * drives.gear * data.qpos[robot.arm_positions][drives.joint]
    ends = []
    for inputs in (drives.lowest, drives.highest):
        driven = np.multiply(drives.gain, inputs, out=np.zeros_like(sprung), where=drives.gain != 0.0)
        ends.append(np.clip(drives.gear * (driven + sprung), -drives.strongest, drives.strongest))
    least, most = (np.bincount(drives.joint, of(*ends)) for of in (np.minimum, np.maximum))
    given = np.clip(needed, least, most)
    names = []
    for index in np.flatnonzero(np.abs(given - needed) > model.dof_frictionloss[robot.arm_velocities] + _SAME):
        joint = int(robot.arm_joints[index])
        unit = "N" if model.jnt_type[joint] == JointKind.SLIDE else "N m"
        names.append(f"{_name(model, joint)} ({abs(given[index]):.1f} of {abs(needed[index]):.1f} {unit})")
    return names


def _grip(scene: Scene, travel: GripperTravel | None) -> list[str]:
    """Return a line if nothing can be gripped, or not the target."""
    if travel is None or not travel.feels:
        why = "no actuator opens and closes fingers beyond the arm's last joint"
        if travel is not None:
            why = "the hand's own parts resist its drive as much as an object could" + _filled(scene)
        elif scene.robot.gripper_actuators.size:
            why = "the hand's actuators do not bring its fingers together over the whole of their ctrlrange"
            why += _filled(scene)
        return [f"{why}: nothing can be grasped"]
    targets = [thing for thing in scene.objects if scene.roles[thing.name] is Role.TARGET]
    opening_m, closed_m = float(travel.openings_m[0]), float(travel.openings_m[-1])
    for thing in targets[:1]:
        thick_m = 2.0 * float(np.sort(scene.model.geom_aabb[list(thing.geoms), 3:].max(axis=0))[0])
        if thick_m > opening_m:
            return [
                f"the open gripper's gap of {1e3 * opening_m:.0f} mm does not span {thing.name!r}, which is"
                f" {1e3 * thick_m:.0f} mm thick"
            ]
        if thick_m < closed_m:
            return [
                f"the fingers close from {1e3 * opening_m:.0f} to {1e3 * closed_m:.0f} mm only: they do not hold"
                f" {thing.name!r}, which is {1e3 * thick_m:.0f} mm thick"
            ]
    return []


def _filled(scene: Scene) -> str:
    """Return how deep parts at the fingertips are inside each other at the start, if so deep that no gap is left."""
    model, robot = scene.model, scene.robot
    deepest_m, one, other = 0.0, 0, 0
    on_finger = set(robot.gripper_geoms[robot.geom_on_finger].tolist())
    approach = scene.data.site_xmat[robot.site].reshape(3, 3)[:, 2]
    hand = robot.gripper_geoms.tolist()
    ends_m = {geom: float((geom_points(model, scene.data, np.array([geom])) @ approach).max()) for geom in hand}
    tips = [geom for geom, end_m in ends_m.items() if end_m > max(ends_m.values()) - _TIPS_M]
    for b, a in combinations(tips, 2):
        if on_finger.isdisjoint((a, b)) or model.geom_bodyid[a] == model.geom_bodyid[b]:
            continue
        if (apart_m := mujoco.mj_geomDistance(model, scene.data, a, b, 1.0, None)) < deepest_m:
            deepest_m, one, other = apart_m, a, b
    if deepest_m > -_FILLS_M:
        return ""
    first, second = (model.geom(geom).name or f"geom{geom}" for geom in (one, other))
    return (
        f" ({first!r} is {-1e3 * deepest_m:.0f} mm inside {second!r}: for contacts MuJoCo takes the convex hull of a"
        " mesh, which fills what is hollow)"
    )


def _driven(model: Any, joint: int) -> bool:
    return any(moves_any(model, actuator, np.array([joint])) for actuator in range(model.nactuator))


def _is_outside(scene: Scene, joint: int) -> bool:
    """Return whether a hinge or slide joint starts outside its range."""
    model = scene.model
    if not model.jnt_limited[joint] or model.jnt_type[joint] not in (JointKind.SLIDE, JointKind.HINGE):
        return False
    lower, upper = model.jnt_range[joint]
    return not lower - _OUTSIDE <= scene.data.qpos[model.jnt_qposadr[joint]] <= upper + _OUTSIDE


def _joints_at(model: Any, positions: Any) -> list[int]:
    return np.flatnonzero(np.isin(model.jnt_qposadr, positions)).tolist()


def _name(model: Any, joint: int) -> str:
    return model.joint(joint).name or f"joint{joint}"


def _few(names: list[str]) -> str:
    more = [f"and {len(names) - _NAMED} more"] if len(names) > _NAMED else []
    return ", ".join([*names[:_NAMED], *more])
