"""Arm, gripper and their actuators in a compiled model, found only from the tool's site."""

import hashlib
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import BoolArray, FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.drivers.mujoco.drives.actuators import find_drives, joint_name, moves_any
from robot_side.drivers.mujoco.drives.joint_drives import JointDrives
from robot_side.drivers.mujoco.model_enums import JointKind

SiteAxis = Literal["x", "-x", "y", "-y", "z", "-z"]

AXES: Final[dict[SiteAxis, tuple[float, float, float]]] = {
    "x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}

_TURNING_OR_SLIDING = (JointKind.HINGE, JointKind.SLIDE)


@dataclass(frozen=True)
class RobotModel:
    """Indices of the robot's parts in a model's arrays.

    The robot is the whole tree of bodies that has the tool's site.
    """

    site: int
    root_body: int
    arm_joints: IntArray
    """(n,) joints between the world and the site"""
    arm_positions: IntArray
    """(n,) indices of the arm's joints in qpos"""
    arm_velocities: IntArray
    """(n,) indices of the arm's joints in qvel and other arrays of degrees of freedom"""
    lower_rad: FloatArray
    """(n,) lower ends of the joints' ranges, `upper_rad` the upper ends; infinite without a limit"""
    upper_rad: FloatArray
    drives: JointDrives
    finger_positions: IntArray
    """(f,) indices in qpos of the finger joints, which are those beyond the last arm joint"""
    finger_velocities: IntArray
    """(f,) indices of the finger joints in qvel"""
    gripper_actuators: IntArray
    """(g,) actuators that move the finger joints"""
    gripper_controls: IntArray
    """(g,) indices of the gripper's actuators in ctrl"""
    fingerprint: str
    """Twelve hexadecimal digits that identify an arm by its joints, links and limits, wherever its base is"""
    gripper_geoms: IntArray
    """(k,) colliding geoms beyond the last arm link, or on that link, too, if fewer than two bodies beyond have any"""
    geom_on_finger: BoolArray
    """(k,) whether a finger joint moves the geom"""


@dataclass(frozen=True)
class Simulated:
    """Robot in a compiled model, with the model's state."""

    model: Any
    """Compiled model, a mujoco.MjModel"""
    data: Any
    """State, a mujoco.MjData"""
    robot: RobotModel


def find_robot(model: Any, site_name: str | None) -> RobotModel:
    """Find the arm that carries the site `site_name` in a compiled MuJoCo model.

    ConfigurationError, of one line, for an unknown site, a model without actuators, a site that no joint moves, a joint
    that is neither hinge nor slide, and an arm joint without an actuator or with one of an unsupported kind.
    """
    site = _find_site(model, site_name)
    if model.nu == 0:
        raise ConfigurationError("model: it has no actuators; valid: an actuator for each joint of the arm")
    chain = _chain(model, int(model.site_bodyid[site]))
    joints = np.array([joint for body in chain for joint in _joints(model, body)], dtype=np.int64)
    if joints.size == 0:
        raise ConfigurationError(
            f"site: no joint moves {site_name!r}{_moved_by_mocap(model, chain)}; valid: a site that 1 or more joints"
            " move, of " + ", ".join(_site_names(model))
        )
    _require_simple(model, joints)

    last_link = int(model.jnt_bodyid[joints[-1]])
    beyond = [body for body in range(model.nbody) if body != last_link and last_link in _chain(model, body)]
    fingers = np.array([joint for body in beyond for joint in _joints(model, body)], dtype=np.int64)
    _require_simple(model, fingers)
    gripper_actuators = np.array(
        [actuator for actuator in range(model.nactuator) if moves_any(model, actuator, fingers)], dtype=np.int64
    )
    geoms = _touching_geoms(model, beyond)
    if len(set(model.geom_bodyid[geoms].tolist())) < 2 and (geoms.size == 0 or fingers.size):
        # A single moving jaw grips against the link that carries it.
        geoms = _touching_geoms(model, [*beyond, last_link])
    moved = {int(body) for body in beyond if set(_chain(model, body)) & set(model.jnt_bodyid[fingers].tolist())}
    limited = model.jnt_limited[joints].astype(bool)
    return RobotModel(
        site=site,
        root_body=chain[0],
        arm_joints=joints,
        arm_positions=model.jnt_qposadr[joints].astype(np.int64),
        arm_velocities=model.jnt_dofadr[joints].astype(np.int64),
        lower_rad=np.where(limited, model.jnt_range[joints, 0], -np.inf),
        upper_rad=np.where(limited, model.jnt_range[joints, 1], np.inf),
        drives=find_drives(model, joints, fingers),
        finger_positions=model.jnt_qposadr[fingers].astype(np.int64),
        finger_velocities=model.jnt_dofadr[fingers].astype(np.int64),
        gripper_actuators=gripper_actuators,
        gripper_controls=model.actuator_ctrladr[gripper_actuators].astype(np.int64),
        fingerprint=_fingerprint(model, joints, site),
        gripper_geoms=geoms,
        geom_on_finger=np.array([int(model.geom_bodyid[geom]) in moved for geom in geoms], dtype=bool),
    )


def joint_names(scene: Simulated) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the arm's joints and of the fingers' joints, in the model's order."""
    model, robot = scene.model, scene.robot
    names = {int(model.jnt_qposadr[joint]): model.joint(joint).name or f"joint{joint}" for joint in range(model.njnt)}
    arm, fingers = (
        tuple(names[place] for place in places.tolist()) for places in (robot.arm_positions, robot.finger_positions)
    )
    return arm, fingers


def turn_site(model: Any, site: int, axis: SiteAxis) -> None:
    """Turn the site's frame in a compiled model so that its new z axis is its present `axis`."""
    if axis == "z":
        return
    turned = Rotation.align_vectors([AXES[axis]], [AXES["z"]])[0]
    own = Rotation.from_quat(model.site_quat[site], scalar_first=True)
    model.site_quat[site] = (own * turned).as_quat(scalar_first=True)
    # MuJoCo takes the body's frame for a site that had the same one.
    model.site_sameframe[site] = 0


def put_site(model: Any, site: int, place_m: FloatArray) -> None:
    """Put the site at `place_m` (3,) in the frame of its body, in a compiled model."""
    if (model.site_pos[site] != place_m).any():
        model.site_pos[site] = place_m
        # MuJoCo takes the body's frame for a site that had the same one.
        model.site_sameframe[site] = 0


def _fingerprint(model: Any, joints: IntArray, site: int) -> str:
    bodies = model.jnt_bodyid[joints]
    parts = (
        model.jnt_type[joints],
        model.jnt_axis[joints],
        model.jnt_pos[joints],
        model.jnt_range[joints],
        model.body_pos[bodies[1:]],
        model.body_quat[bodies[1:]],
        model.site_pos[site],
        model.site_quat[site],
    )
    rounded = np.concatenate([np.asarray(part, dtype=np.float64).ravel() for part in parts]).round(6) + 0.0
    return hashlib.sha256(rounded.tobytes()).hexdigest()[:12]


def can_touch(model: Any, geom: int) -> bool:
    """Return whether a geom takes part in collisions; all other geoms are only visual."""
    return bool(model.geom_contype[geom]) or bool(model.geom_conaffinity[geom])


def _site_names(model: Any) -> list[str]:
    return [model.site(site).name for site in range(model.nsite) if model.site(site).name]


def _moved_by_mocap(model: Any, chain: list[int]) -> str:
    mocap = bool(chain) and bool((model.body_mocapid[chain] >= 0).any())
    return ": a mocap body carries it, which no real robot has" if mocap else ""


def _find_site(model: Any, site_name: str | None) -> int:
    names = _site_names(model)
    if not names:
        raise ConfigurationError(
            "site: the model has no named site; valid: a site at the tool, whose z axis is the approach"
        )
    if site_name not in names:
        said = "none is given" if site_name is None else f"the model has no site {site_name!r}"
        raise ConfigurationError(f"site: {said}; valid: {', '.join(names)}")
    return int(model.site(site_name).id)


def _chain(model: Any, body: int) -> list[int]:
    """Return the bodies on the chain from the world's child to `body`, in this order."""
    chain: list[int] = []
    while body != 0:
        chain.insert(0, body)
        body = int(model.body_parentid[body])
    return chain


def _joints(model: Any, body: int) -> range:
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))


def _require_simple(model: Any, joints: IntArray) -> None:
    for joint in joints:
        if model.jnt_type[joint] not in _TURNING_OR_SLIDING:
            kind = JointKind(int(model.jnt_type[joint])).name.lower()
            why = "the robot's base must stand fixed" if kind == "free" else "no single motor moves such a joint"
            raise ConfigurationError(f"model: {joint_name(model, joint)} is {kind}: {why}; valid: hinge or slide")


def machines(model: Any) -> set[int]:
    """Return the root bodies of all that has a driven joint, such as arms."""
    return {
        int(model.body_rootid[model.jnt_bodyid[joint]])
        for joint in range(model.njnt)
        if any(moves_any(model, actuator, np.array([joint])) for actuator in range(model.nactuator))
    }


def _touching_geoms(model: Any, bodies: list[int]) -> IntArray:
    on_bodies = np.flatnonzero(np.isin(model.geom_bodyid, bodies))
    return np.array([geom for geom in on_bodies if can_touch(model, int(geom))], dtype=np.int64)
