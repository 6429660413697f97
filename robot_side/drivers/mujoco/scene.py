"""Simulated world of an arm among objects, loaded from MJCF files."""

import logging
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.files.input_file import require_input_file
from common.roles import Role
from robot_side.arm.port import ArmState
from robot_side.drivers.mujoco.brought.table import TABLE_PREFIX, attach, keep_from_slipping, settle, usual_table_pose
from robot_side.drivers.mujoco.brought.trial import hearing_signals, try_model, unusable
from robot_side.drivers.mujoco.built_in_scenes import SceneName, furnish
from robot_side.drivers.mujoco.hand.gripper_servos import serve_gripper
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.object_primitives import ObjectPrimitives, SceneObject
from robot_side.drivers.mujoco.robot_model import (
    RobotModel,
    Simulated,
    SiteAxis,
    can_touch,
    find_robot,
    machines,
    put_site,
    turn_site,
)
from robot_side.surroundings.roles import assign_roles

_LOG = logging.getLogger(__name__)
_ASSETS = Path(__file__).parent / "assets"
_START_KEY = "feelahead_start"
_FOUND_START = (
    "a pose that was searched for, in which it reaches the target, as the model has no keyframe (to choose a pose: a"
    " keyframe named 'home')"
)
_MOVED = "; the tool's point is {1:.0f} mm from the site {0!r}, between the fingertips"
# Longer steps make the arm's servos oscillate; shorter ones are too slow for real time on any machine.
_SHORTEST_STEP_S, _LONGEST_STEP_S = 1e-5, 0.02
_FARTHEST_M = 1e6
_MOST_ACCELERATION = 1e10
"""Acceleration above which MuJoCo calls a simulation unstable, in m/s² or rad/s²"""


@dataclass(frozen=True)
class Scene(Simulated):
    """Compiled model and its only live state, which the arm advances and all others only read."""

    objects: tuple[SceneObject, ...]
    roles: dict[str, Role]
    """Present role of each object; `MujocoCamera.set_role` changes it."""
    primitives: ObjectPrimitives
    start_pose: str
    """Description of the arm's start pose"""
    shared_names: tuple[str, ...]
    """Names that several elements share, such as a body and a geom of the world; each name makes one object."""
    warnings: tuple[str, ...]
    """Warnings that MuJoCo gave about the model"""

    @property
    def fixed(self) -> frozenset[str]:
        """Names of the objects that neither a joint nor a mocap body can move"""
        model = self.model
        movable = (model.body_weldid != 0) | (model.body_mocapid[model.body_rootid] >= 0)
        moves = movable[model.geom_bodyid]
        return frozenset(thing.name for thing in self.objects if not any(moves[geom] for geom in thing.geoms))

    @property
    def never_held(self) -> frozenset[str]:
        """Names of the objects that cannot be held: fixed ones, and machines with actuators, such as another arm"""
        model = self.model
        driven, roots = machines(model), model.body_rootid[model.geom_bodyid]
        return self.fixed | {
            thing.name for thing in self.objects if any(int(roots[geom]) in driven for geom in thing.geoms)
        }

    def step(self) -> None:
        """Advance the state by one step, with the actuators' present inputs."""
        mujoco.mj_step(self.model, self.data)

    def show(self, measured: ArmState) -> None:
        """Set the robot to the state that a driver measured on its arm; such a scene is not simulated."""
        self.data.qpos[self.robot.arm_positions] = measured.joint_positions_rad
        self.data.qpos[self.robot.finger_positions] = measured.finger_positions
        mujoco.mj_kinematics(self.model, self.data)


def load_scene(
    model_path: Path | None = None,
    site: str | None = None,
    roles: Mapping[str, Role] | None = None,
    name: SceneName = "table",
    seed: int = 0,
    site_axis: SiteAxis = "z",
) -> Scene:
    """Load the built-in arm, or the MJCF file `model_path`, whose tool is the site `site`.

    A file with only a robot, planes and other machines gets the built-in scene `name`, drawn from `seed`, in front of
    the robot; so does the built-in arm. The arm starts at the keyframe `home`, else at the first keyframe, else in the
    middle of the joints' ranges; at the table, if that is out of reach, in a pose that is searched for.
    roles: override the roles that objects' names tell. The tool's z axis is the site's `site_axis`.
    ConfigurationError, of one line, for a file, model or site that cannot be used.
    """
    if model_path is None and site_axis != "z":
        raise ConfigurationError(f"--site-axis {site_axis} is given without --model; valid: with --model")
    mujoco.set_mju_user_warning(_log_warning)
    if model_path is None:
        return _load(None, site, roles or {}, name, seed, site_axis)
    try:
        require_input_file("--model", model_path, "an MJCF file")
    except ValueError as error:
        raise ConfigurationError(str(error)) from None
    try_model(model_path.resolve())
    return hearing_signals(lambda: _load(model_path, site, roles or {}, name, seed, site_axis))


def _load(
    model_path: Path | None,
    site: str | None,
    roles: Mapping[str, Role],
    name: SceneName,
    seed: int,
    site_axis: SiteAxis,
) -> Scene:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        if model_path is None:
            spec, site = _read(_ASSETS / "arm.xml"), site or "tool"
        else:
            spec = _read(model_path)
        model, robot = _with_robot(spec, site)
        _require_step(float(model.opt.timestep))
        turn_site(model, robot.site, site_axis)
        start, start_pose = _start_configuration(model, robot)
        if _is_alone(model, robot):
            table = _read(_ASSETS / f"{name}_scene.xml")
            furnish(table, name, seed)
            if model_path is not None and name == "table":
                keep_from_slipping(spec)
                start, place, moved_m, found = settle(table, model, robot, start, may_search=model.nkey == 0)
                start_pose = _FOUND_START if found else start_pose
                if moved_m:
                    start_pose += _MOVED.format(site, 1e3 * moved_m)
            else:
                place = usual_table_pose(model, robot, start)
            # Attaching extends the keyframes by the attached joints, so that a keyframe preserves the configuration.
            start_key = _START_KEY
            while any(model.key(key).name == start_key for key in range(model.nkey)):
                start_key += "_"
            spec.add_key(name=start_key, qpos=start)
            attach(table, spec, model, robot, start, place)
            place_m = model.site_pos[robot.site].copy()
            model, robot = _with_robot(spec, site)
            turn_site(model, robot.site, site_axis)
            put_site(model, robot.site, place_m)
            start = model.key(start_key).qpos
    data = mujoco.MjData(model)
    data.qpos[:] = start
    data.qvel[:] = _start_velocities(model, robot)
    try:
        mujoco.mj_forward(model, data)
    except mujoco.FatalError as error:
        raise ConfigurationError(
            f"model: MuJoCo cannot simulate it: {' '.join(str(error).split())}; valid: a model that fits its memory"
        ) from error
    for geom in np.flatnonzero(~(np.abs(data.geom_xpos) < _FARTHEST_M).all(axis=1)):
        stray = model.geom(int(geom)).name or f"geom{geom}"
        raise ConfigurationError(
            f"model: {stray!r} is at the position {data.geom_xpos[geom]}; valid: a finite position"
        )
    if not (np.abs(data.qacc) < _MOST_ACCELERATION).all():
        raise ConfigurationError(
            "model: at its start its joints accelerate without bound; valid: finite gravity, masses and lengths"
        )
    objects, shared_names = _objects(model, robot)
    return Scene(
        model=model,
        data=data,
        robot=robot,
        objects=objects,
        roles=assign_roles([thing.name for thing in objects], roles),
        primitives=ObjectPrimitives(model, objects),
        start_pose=start_pose,
        shared_names=shared_names,
        warnings=tuple(" ".join(str(warning.message).split()) for warning in said),
    )


def _require_step(timestep_s: float) -> None:
    if not _SHORTEST_STEP_S <= timestep_s <= _LONGEST_STEP_S:
        raise ConfigurationError(
            f"model: timestep = {timestep_s}; valid: {_SHORTEST_STEP_S:g} to {_LONGEST_STEP_S:g} s, such as 0.002"
        )


def _is_alone(model: Any, robot: RobotModel) -> bool:
    """Return whether a model has nothing but the robot, planes, and other machines such as a second arm."""
    driven, roots = machines(model), model.body_rootid[model.geom_bodyid]
    geoms = [geom for thing in _objects(model, robot)[0] for geom in thing.geoms]
    return all(model.geom_type[geom] == GeomKind.PLANE or int(roots[geom]) in driven for geom in geoms)


def _log_warning(message: str) -> None:
    # MuJoCo's own handler writes a file into the working directory.
    _LOG.info("MuJoCo: %s", message)


def _read(model_path: Path) -> Any:
    try:
        return mujoco.MjSpec.from_file(str(model_path))
    except (ValueError, mujoco.FatalError) as error:
        raise unusable(error) from error


def _compile(spec: Any) -> Any:
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise unusable(error) from error


def _with_robot(spec: Any, site: str | None) -> tuple[Any, RobotModel]:
    """Return the compiled model, whose gripper's actuators are position servos from now on, and the robot in it."""
    model = _compile(spec)
    robot = find_robot(model, site)
    return (_compile(spec) if serve_gripper(spec, model, robot) else model), robot


def _start_key(model: Any) -> int | None:
    """Return the keyframe at which the arm starts: `home`, else the first one; None without keyframes."""
    keyframes = [model.key(key).name for key in range(model.nkey)]
    if not keyframes:
        return None
    return keyframes.index("home") if "home" in keyframes else 0


def _start_configuration(model: Any, robot: RobotModel) -> tuple[FloatArray, str]:
    """Return qpos (nq,) of the start keyframe, else of the middle of the joints' ranges; and its description."""
    start: FloatArray
    key = _start_key(model)
    if key is not None:
        start, name = _finite(model, key, "qpos"), model.key(key).name
        if name == "home":
            return start, "the keyframe 'home'"
        return start, f"the first keyframe, {name!r} (a keyframe named 'home' would be used instead)"
    start = model.qpos0.copy()
    limited = np.isfinite(robot.lower_rad)
    start[robot.arm_positions[limited]] = 0.5 * (robot.lower_rad[limited] + robot.upper_rad[limited])
    return (
        start,
        "the middle of the joints' ranges, as the model has no keyframe (to choose a pose: a keyframe named 'home')",
    )


def _start_velocities(model: Any, robot: RobotModel) -> FloatArray:
    """Return qvel (nv,) of the start keyframe, with the robot at rest."""
    key = _start_key(model)
    if key is None:
        return np.zeros(model.nv)
    velocities = _finite(model, key, "qvel")
    velocities[model.body_rootid[model.dof_bodyid] == robot.root_body] = 0.0
    return velocities


def _finite(model: Any, key: int, part: str) -> FloatArray:
    """Return a copy of a keyframe's `part`, qpos or qvel; ConfigurationError if it is not finite."""
    values: FloatArray = getattr(model, f"key_{part}")[key].copy()
    if not np.isfinite(values).all():
        raise ConfigurationError(f"model: keyframe {model.key(key).name!r} holds NaN or infinity; valid: finite {part}")
    return values


def _objects(model: Any, robot: RobotModel) -> tuple[tuple[SceneObject, ...], tuple[str, ...]]:
    """Return the colliding objects other than the robot, in the order of their first geoms, and the shared names."""
    geoms_of: dict[str, list[int]] = {}
    parts_of: dict[str, set[tuple[str, int]]] = {}
    for geom in range(model.ngeom):
        root = int(model.body_rootid[model.geom_bodyid[geom]])
        if root == robot.root_body or not can_touch(model, geom):
            continue
        # Each geom of the world is an object, unless names are shared; a tree of bodies is one object.
        kind, index, named = ("geom", geom, model.geom(geom)) if root == 0 else ("body", root, model.body(root))
        name = named.name.removeprefix(TABLE_PREFIX) or f"{kind}{index}"
        geoms_of.setdefault(name, []).append(geom)
        parts_of.setdefault(name, set()).add((kind, index))
    shared = tuple(name for name, parts in parts_of.items() if len(parts) > 1)
    return tuple(SceneObject(name, tuple(geoms)) for name, geoms in geoms_of.items()), shared
