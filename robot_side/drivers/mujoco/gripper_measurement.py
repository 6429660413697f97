"""Measurement of a simulated gripper: its travel, by driving it, and the open gap that its spheres leave."""

import copy
from dataclasses import dataclass
from itertools import product
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.drivers.mujoco.gripper_cover import GripperCover, link_solids
from robot_side.drivers.mujoco.mesh_arrays import geom_points
from robot_side.drivers.mujoco.robot_model import RobotModel, Simulated

_GRIPPER_SAMPLES = 9
_SHORTEST_SETTLING_S, _LONGEST_SETTLING_S = 0.05, 2.0
_FARTHEST_GAP_M = 0.5
_ALIKE_M = 1e-4
# Largest lead of a reference over a blocked drive without a force limit, as a share of the stroke.
_DEFAULT_FORCE_LEAD = 0.3
# Pairs of surfaces within this distance of the nearest pair, in the closed gripper, take part in the grasp.
_GRASP_BAND_M = 2e-3
_SMALLEST_STROKE_M = 1e-3
# Distance from the gripper's farthest end within which its geoms are fingertips; links of the fingers end before.
_TIPS_M = 0.03


@dataclass(frozen=True)
class GripperSweep:
    """Rest positions of a gripper at k evenly spaced inputs, from one end of the inputs to the other."""

    controls: FloatArray
    """(k, g) inputs of the actuators"""
    fingers: FloatArray
    """(k, f) positions of the fingers' joints"""
    lengths: FloatArray
    """(k,) positions of the first actuator, in the unit of its transmission"""
    gaps_m: FloatArray
    """(k, p) distances between pairs of the gripper's geoms, in m, negative where they overlap"""

    @property
    def stroke_m(self) -> float:
        """Largest change of any pair's distance during the sweep, in m"""
        return float(np.ptp(self.gaps_m, axis=0).max(initial=0.0))


@dataclass(frozen=True)
class GripperTravel:
    """Travel of the gripper from open to closed, at k samples."""

    open_control: FloatArray
    """(g,) inputs of the actuators when open"""
    closed_control: FloatArray
    """(g,) inputs of the actuators when closed"""
    open_fingers: FloatArray
    """(f,) positions of the fingers' joints when open"""
    closed_fingers: FloatArray
    """(f,) positions of the fingers' joints when closed"""
    references: FloatArray
    """(k,) inputs as shares of the way from open (0) to closed (1), rising"""
    lengths: FloatArray
    """(k,) positions of the first actuator at the inputs `references`, rising or falling"""
    openings_m: FloatArray
    """(k,) free gaps between the fingers at the inputs `references`, in m"""
    force_lead: float
    """Lead of the reference over a blocked drive that gives the largest allowed force, as a share of the stroke"""
    lag_s: float
    """Lag of a moving drive behind its reference, in seconds: shares of the stroke for each share per second"""


def measure_gripper(scene: Simulated) -> GripperTravel | None:
    """Measure the gripper's travel, by driving a copy of the scene's gripper to both ends in empty space.

    None without a gripper, or if its fingers' geoms do not approach each other. ConfigurationError for a gripper
    actuator whose range of inputs is not known.
    """
    robot, actuators = scene.robot, scene.robot.gripper_actuators
    if actuators.size == 0:
        return None
    model = copy.copy(scene.model)
    unknown = actuators[~model.actuator_ctrllimited[actuators].astype(bool)]
    if unknown.size:
        named = model.actuator(int(unknown[0])).name or int(unknown[0])
        raise ConfigurationError(
            f"model: the gripper's actuator {named!r} has no ctrlrange; valid: the inputs at which the gripper is open"
            " and closed"
        )
    # The copy is in empty space; its arm is without drive and put back after every step.
    model.opt.gravity[:] = 0.0
    elsewhere = model.body_rootid[model.geom_bodyid] != robot.root_body
    model.geom_contype[elsewhere] = model.geom_conaffinity[elsewhere] = 0
    idle = np.setdiff1d(np.arange(model.nu), actuators)
    model.actuator_gainprm[idle] = model.actuator_biasprm[idle] = 0.0
    ranges = model.actuator_ctrlrange[actuators]
    sweeps = [_sweep_gripper(model, scene, *ends) for ends in candidate_ends(ranges[:, 0], ranges[:, 1])]
    sweep = max(sweeps, key=lambda one: one.stroke_m)
    limits = np.where(
        model.actuator_forcelimited[actuators], np.abs(model.actuator_forcerange[actuators]).min(axis=1), np.inf
    )
    # force = gain u - stiffness l - damping dl/dt
    stiffness, damping = -model.actuator_biasprm[actuators, 1], -model.actuator_biasprm[actuators, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        leads = limits / np.abs(model.actuator_gainprm[actuators, 0] * (sweep.controls[-1] - sweep.controls[0]))
        lags = np.where(stiffness > 0.0, damping / stiffness, 0.0)
    return travel_from_sweep(sweep, min(_DEFAULT_FORCE_LEAD, float(leads.min())), float(lags.max()))


def _sweep_gripper(model: Any, scene: Simulated, first: FloatArray, last: FloatArray) -> GripperSweep:
    robot, data = scene.robot, mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    held = scene.data.qpos[robot.arm_positions].copy()
    mujoco.mj_kinematics(model, data)
    pairs = _pairs(model, data, robot)
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
        fingers = data.qpos[robot.finger_positions].copy()
        samples.append((control, fingers, float(data.actuator_length[robot.gripper_actuators[0]]), gaps))
    return GripperSweep(*(np.array(column) for column in zip(*samples, strict=True)))


def candidate_ends(lower: FloatArray, upper: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return the possible pairs of inputs (g,) at the two ends of the travel, from the actuators' ranges (g,).

    Two actuators may run in the same or in opposite directions; more than two are assumed to run in the same direction.
    """
    count = lower.size
    choices = product((False, True), repeat=count - 1) if count <= 2 else [(False,) * (count - 1)]
    swapped = [np.array((False, *choice)) for choice in choices]
    return [(np.where(swap, upper, lower), np.where(swap, lower, upper)) for swap in swapped]


def jaw_pairs(geoms: IntArray, bodies: IntArray, on_finger: BoolArray) -> list[tuple[int, int]]:
    """Return the pairs of a gripper's geoms that can grip an object between them; all arguments have the shape (k,).

    At least one geom of a pair is on a finger, and the two are on different bodies.
    """
    return [
        (int(geoms[a]), int(geoms[b]))
        for a in range(geoms.size)
        for b in range(a)
        if (on_finger[a] or on_finger[b]) and bodies[a] != bodies[b]
    ]


def travel_from_sweep(sweep: GripperSweep, force_lead: float, lag_s: float) -> GripperTravel | None:
    """Return the gripper's travel; None if no distance between geoms changes or the drive does not move.

    The free gap is between those surfaces that move far and are nearest to each other in the closed gripper.
    """
    stroke_m, lengths = sweep.stroke_m, sweep.lengths
    if stroke_m < _SMALLEST_STROKE_M or lengths[0] == lengths[-1]:
        return None
    jaws = sweep.gaps_m[:, np.ptp(sweep.gaps_m, axis=0) > 0.5 * stroke_m]
    controls, fingers = sweep.controls, sweep.fingers
    if jaws[0].min() < jaws[-1].min():
        controls, fingers, lengths, jaws = controls[::-1], fingers[::-1], lengths[::-1], jaws[::-1]
    # Geoms that pass through each other grip nothing between them.
    apart = jaws[-1] > -_GRASP_BAND_M
    jaws = jaws[:, apart] if apart.any() else jaws
    jaws = jaws[:, jaws[-1] <= jaws[-1].min() + _GRASP_BAND_M]
    openings = np.maximum(jaws.min(axis=1), 0.0)
    closures = (lengths - lengths[0]) / (lengths[-1] - lengths[0])
    # Fingers that press on each other stop the drive before the last input.
    highest_before = np.concatenate([[-np.inf], np.maximum.accumulate(closures)[:-1]])
    moving = closures > highest_before + 1e-3
    return GripperTravel(
        open_control=controls[0],
        closed_control=controls[-1],
        open_fingers=fingers[0],
        closed_fingers=fingers[-1],
        references=np.linspace(0.0, 1.0, len(lengths))[moving],
        lengths=lengths[moving],
        openings_m=openings[moving],
        force_lead=force_lead,
        lag_s=lag_s,
    )


def open_gap(scene: Simulated, cover: GripperCover) -> tuple[float, float] | None:
    """Return the gap between the gripping geoms of the open gripper, and the least between their spheres, in m.

    None without fingers.
    """
    travel, model, robot = measure_gripper(scene), scene.model, scene.robot
    if travel is None:
        return None
    data = mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    data.qpos[robot.finger_positions] = travel.open_fingers
    mujoco.mj_forward(model, data)
    gaps = _gaps_m(model, data, robot)
    opening_m = min(gaps.values(), key=lambda gap: abs(gap - travel.openings_m[0]))
    kept_m = opening_m
    for pair in (pair for pair, gap in gaps.items() if abs(gap - opening_m) < _ALIKE_M):
        one, other = (_spheres_of(scene, cover, data, geom) for geom in pair)
        apart = np.linalg.norm(one[0][:, None] - other[0], axis=2) - one[1][:, None] - other[1]
        kept_m = min(kept_m, float(apart.min(initial=np.inf)))
    return float(opening_m), max(kept_m, 0.0)


def nearest_pair(model: Any, data: Any, robot: RobotModel, opening_m: float) -> tuple[int, int]:
    """Return those two of the gripper's geoms whose distance is nearest to `opening_m`."""
    gaps = _gaps_m(model, data, robot)
    return min(gaps, key=lambda pair: abs(gaps[pair] - opening_m))


def _gaps_m(model: Any, data: Any, robot: RobotModel) -> dict[tuple[int, int], float]:
    """Return the distances, in m, between the gripper's geoms that can grip an object between them."""
    pairs = _pairs(model, data, robot)
    return {pair: mujoco.mj_geomDistance(model, data, *pair, _FARTHEST_GAP_M, None) for pair in pairs}


def _pairs(model: Any, data: Any, robot: RobotModel) -> list[tuple[int, int]]:
    """Return the pairs of the gripper's geoms that can grip an object; those at the fingertips, if there are any."""
    geoms, approach = robot.gripper_geoms, data.site_xmat[robot.site].reshape(3, 3)[:, 2]
    ends_m = np.array([float((geom_points(model, data, geoms[[k]]) @ approach).max()) for k in range(geoms.size)])
    at_tips = ends_m > ends_m.max(initial=-np.inf) - _TIPS_M
    pairs = jaw_pairs(geoms, model.geom_bodyid[geoms], robot.geom_on_finger)
    tips = set(geoms[at_tips].tolist())
    return [pair for pair in pairs if tips.issuperset(pair)] or pairs


def _spheres_of(scene: Simulated, cover: GripperCover, data: Any, geom: int) -> tuple[FloatArray, FloatArray]:
    """Return centres (m, 3) in the world frame and radii (m,) of those spheres whose centres are in a geom."""
    link = int(scene.model.geom_bodyid[geom])
    own = np.flatnonzero(cover.bodies == link)
    for solid in link_solids(scene.model, [geom]):
        own = own[solid.depth_m(cover.centers_m[own]) >= -1e-9]
    return data.xpos[link] + cover.centers_m[own] @ data.xmat[link].reshape(3, 3).T, cover.radii_m[own]
