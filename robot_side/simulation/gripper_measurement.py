"""How far a simulated gripper opens, found by driving it, and what its spheres leave of that."""

import copy
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.simulation.gripper_cover import GripperCover, link_solids
from robot_side.simulation.gripper_travel import (
    GripperSample,
    GripperServo,
    GripperTravel,
    candidate_ends,
    jaw_pairs,
    jaw_stroke_m,
    travel_from_samples,
)
from robot_side.simulation.scene import Scene

_GRIPPER_SAMPLES = 9
_SHORTEST_SETTLING_S, _LONGEST_SETTLING_S = 0.05, 2.0
_FARTHEST_GAP_M = 0.5
_ALIKE_M = 1e-4


def measure_gripper(scene: Scene) -> GripperTravel | None:
    """How the gripper of `scene` opens and closes, found by driving a copy of it to both ends in empty space.

    None without a gripper, or with one whose fingers' geoms do not come nearer to each other.
    ConfigurationError for a gripper actuator whose range of inputs is not known.
    """
    robot, actuators = scene.robot, scene.robot.gripper_actuators
    if actuators.size == 0:
        return None
    model = copy.copy(scene.model)
    unknown = actuators[~model.actuator_ctrllimited[actuators].astype(bool)]
    if unknown.size:
        raise ConfigurationError(
            f"model: the gripper's actuator {model.actuator(int(unknown[0])).name!r} has no ctrlrange; valid: its open"
            " and its closed input"
        )
    # The copy hangs in empty space, and its arm is left limp and put back after every step.
    model.opt.gravity[:] = 0.0
    elsewhere = model.body_rootid[model.geom_bodyid] != robot.root_body
    model.geom_contype[elsewhere] = model.geom_conaffinity[elsewhere] = 0
    idle = np.setdiff1d(np.arange(model.nu), actuators)
    model.actuator_gainprm[idle] = model.actuator_biasprm[idle] = 0.0
    ranges = model.actuator_ctrlrange[actuators]
    sweeps = [_sweep_gripper(model, scene, *ends) for ends in candidate_ends(ranges[:, 0], ranges[:, 1])]
    servo = GripperServo(
        gain=model.actuator_gainprm[actuators, 0],
        stiffness=-model.actuator_biasprm[actuators, 1],
        damping=-model.actuator_biasprm[actuators, 2],
        force_limit=np.where(
            model.actuator_forcelimited[actuators], np.abs(model.actuator_forcerange[actuators]).min(axis=1), np.inf
        ),
    )
    return travel_from_samples(max(sweeps, key=jaw_stroke_m), servo)


def _sweep_gripper(model: Any, scene: Scene, first: FloatArray, last: FloatArray) -> list[GripperSample]:
    robot, data = scene.robot, mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    held = scene.data.qpos[robot.arm_positions].copy()
    pairs = jaw_pairs(robot.gripper_geoms, model.geom_bodyid[robot.gripper_geoms], robot.geom_on_finger)
    samples = []
    for share in np.linspace(0.0, 1.0, _GRIPPER_SAMPLES):
        control = first + share * (last - first)
        data.ctrl[robot.gripper_controls] = control
        for step in range(round(_LONGEST_SETTLING_S / model.opt.timestep)):
            mujoco.mj_step(model, data)
            data.qpos[robot.arm_positions] = held
            data.qvel[robot.arm_velocities] = 0.0
            resting = np.abs(data.qvel[robot.finger_velocities]).max(initial=0.0) < 1e-3
            if resting and step * model.opt.timestep > _SHORTEST_SETTLING_S:
                break
        mujoco.mj_forward(model, data)
        gaps = [mujoco.mj_geomDistance(model, data, *pair, _FARTHEST_GAP_M, None) for pair in pairs]
        samples.append(
            GripperSample(
                control=control,
                fingers=data.qpos[robot.finger_positions].copy(),
                length=float(data.actuator_length[robot.gripper_actuators[0]]),
                gaps_m=np.array(gaps),
            )
        )
    return samples


def open_gap(scene: Scene, cover: GripperCover) -> tuple[float, float] | None:
    """(m between the geoms that grip, the least m between their spheres), open; None without fingers."""
    travel, model, robot = measure_gripper(scene), scene.model, scene.robot
    if travel is None:
        return None
    data = mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    data.qpos[robot.finger_positions] = travel.open_fingers
    mujoco.mj_forward(model, data)
    bodies = model.geom_bodyid[robot.gripper_geoms]
    gaps = {
        pair: mujoco.mj_geomDistance(model, data, *pair, _FARTHEST_GAP_M, None)
        for pair in jaw_pairs(robot.gripper_geoms, bodies, robot.geom_on_finger)
    }
    opening_m = min(gaps.values(), key=lambda gap: abs(gap - travel.openings_m[0]))
    kept_m = opening_m
    for pair in (pair for pair, gap in gaps.items() if abs(gap - opening_m) < _ALIKE_M):
        one, other = (_spheres_of(scene, cover, data, geom) for geom in pair)
        apart = np.linalg.norm(one[0][:, None] - other[0], axis=2) - one[1][:, None] - other[1]
        kept_m = min(kept_m, float(apart.min(initial=np.inf)))
    return float(opening_m), max(kept_m, 0.0)


def _spheres_of(scene: Scene, cover: GripperCover, data: Any, geom: int) -> tuple[FloatArray, FloatArray]:
    """Centres (m, 3) in the world and radii (m,) of the spheres whose centres are in a geom."""
    link = int(scene.model.geom_bodyid[geom])
    own = np.flatnonzero(cover.bodies == link)
    for solid in link_solids(scene.model, [geom]):
        own = own[solid.depth_m(cover.centers_m[own]) >= -1e-9]
    return data.xpos[link] + cover.centers_m[own] @ data.xmat[link].reshape(3, 3).T, cover.radii_m[own]
