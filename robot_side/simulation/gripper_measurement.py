"""How far a simulated gripper opens, found by driving it."""

import copy
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
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
