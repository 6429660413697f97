"""Measurement of a simulated gripper's travel, by driving it in empty space: what its inputs do, and its gap."""

from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import sha256
from itertools import product
from typing import Any, Final
from weakref import ref

import mujoco  # type: ignore[import-untyped]
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from common.arrays import FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.drivers.mujoco.hand.gripper_cover import GripperCover
from robot_side.drivers.mujoco.hand.gripper_gap import Gap, Jaw, convex_geoms, find_gap, patch_m
from robot_side.drivers.mujoco.hand.gripper_sweep import ClosingRun, EmptySpace, GripperSweep
from robot_side.drivers.mujoco.robot_model import RobotModel, Simulated

LEAD: Final = 0.3
"""Largest lead of the reference over a blocked drive, as a share of the stroke"""
NOTHING_M: Final = 1e-3
"""Gap beyond that of the closed gripper up to which nothing is held"""
_RESISTS: Final = 0.02
"""Least lead of the reference over a free drive, as a share of the stroke, at which something resists"""
STANDING_TIME_S: Final = 0.05
STANDING_SPEED_1_S: Final = 0.05
"""Speed of the closure, in 1/s, below which the fingers rest, if they do so for the standing time"""
_SAFELY: Final = 1.5
"""Factor for what the gripper itself resists, which differs from time to time"""
_WEIGHED: Final = 7
"""Number of inputs at which the fingers' weight is tried"""
_CLOSED: Final = 0.05
"""Last share of the travel, in which fingers without a gap are closed"""
_FLAT: Final = 1e-3
"""Share of the travel up to which inputs move nothing"""


@dataclass(frozen=True)
class GripperTravel:
    """Travel of the gripper from open to closed, at k samples of its g actuators' inputs."""

    open_control: FloatArray
    """(g,) inputs of the actuators from which on the fingers close"""
    closed_control: FloatArray
    """(g,) inputs of the actuators at which the fingers have closed"""
    open_fingers: FloatArray
    """(f,) positions of the fingers' joints when open"""
    closed_fingers: FloatArray
    """(f,) positions of the fingers' joints when closed"""
    open_lengths: FloatArray
    """(g,) lengths of the actuators when open"""
    per_length: FloatArray
    """(g,) weights with which the changes of the lengths add up to the closure, from 0 (open) to 1 (closed)"""
    references: FloatArray
    """(k,) inputs as shares of the way from open (0) to closed (1), rising"""
    closures: FloatArray
    """(k,) closures at rest at the inputs `references`, rising"""
    openings_m: FloatArray
    """(k,) free gaps between the jaws at these closures, in m"""
    resists: FloatArray
    """(k,) leads of the reference at these closures up to which the gripper may be alone: its own friction and weight,
    and links that hinder each other"""
    ends: tuple[float, float]
    """Least and greatest reference that the actuators' ranges allow"""
    lags_s: tuple[float, float]
    """Lags of a moving drive behind its reference, in seconds: shares of the stroke for each share per second: by the
    servo's own damping, which needs no force, and in all"""
    force_lead: float
    """Lead beyond the first lag that gives the servo's largest force, as a share of the stroke; infinite without one"""
    opening_force_lead: float
    """Such a lead when the gripper opens; another one where a servo pulls only"""
    ahead_m: float
    """Reach of the fingers ahead of the tool's site, open or closed, in m"""
    closing: FloatArray
    """(3,) direction in the frame of the tool's site along which the jaws close, from the first jaw to the second"""
    jaws: tuple[Jaw, Jaw]

    @property
    def closed_from(self) -> float:
        """Closure from which on nothing is held: the gap is that of the closed gripper, and the fingers' way is over.

        Fingers that bend around things meet beside the tool before they have closed.
        """
        return closed_from(self.closures, self.openings_m)

    @property
    def feels(self) -> bool:
        """Whether the drive's lead can tell an object from what the gripper itself resists, somewhere in the travel."""
        return bool((self.resists < min(LEAD, self.force_lead))[self.closures < self.closed_from].any())


def measure_gripper(scene: Simulated) -> GripperTravel | None:
    """Measure the gripper's travel, by driving a copy of the scene's gripper to both ends in empty space.

    None without a gripper, or if its jaws do not close beside the tool. ConfigurationError for a gripper actuator whose
    range of inputs is not known. The same model in the same configuration is measured once in a process.
    """
    if scene.robot.gripper_actuators.size == 0:
        return None
    saved = np.empty(mujoco.mj_sizeModel(scene.model), dtype=np.uint8)
    mujoco.mj_saveModel(scene.model, None, saved)
    return _measured(_Same(sha256(saved.tobytes()).digest(), scene.robot.site, scene.data.qpos.tobytes(), ref(scene)))


@dataclass(frozen=True)
class _Same:
    """Scene that equals another one if their grippers measure the same."""

    model: bytes
    """Hash of the model"""
    site: int
    start: bytes
    scene: ref[Simulated] = field(compare=False)
    """The scene itself, which nothing keeps once it was measured"""


@lru_cache(maxsize=8)
def _measured(same: _Same) -> GripperTravel | None:
    scene: Any = same.scene()  # alive, as the caller has it
    model, actuators, controls = scene.model, scene.robot.gripper_actuators, scene.robot.gripper_controls
    unknown = actuators[~model.actuator_ctrllimited[controls].astype(bool)]
    if unknown.size:
        named = model.actuator(int(unknown[0])).name or int(unknown[0])
        raise ConfigurationError(
            f"model: the gripper's actuator {named!r} has no ctrlrange; valid: the inputs at which the gripper is open"
            " and closed"
        )
    space, (lower, upper) = EmptySpace(scene), model.actuator_ctrlrange[controls].T
    solids = convex_geoms(model, scene.robot.gripper_geoms)

    def gap_of(sweep: GripperSweep) -> Gap | None:
        return find_gap(model, solids, sweep.poses, sweep.ahead_m)

    swept = [(sweep, gap_of(sweep)) for sweep in (space.sweep(*ends) for ends in candidate_ends(lower, upper))]
    sweep, gap = max(swept, key=lambda one: 0.0 if one[1] is None else float(np.ptp(one[1].sizes_m)))
    if gap is None:
        return None
    first, last = space.moving_ends(sweep)
    if not gap.closes or (first != sweep.controls[0]).any() or (last != sweep.controls[-1]).any():
        # From open to closed, as dry friction lets the fingers rest elsewhere on the way back.
        sweep = space.sweep(*((first, last) if gap.closes else (last, first)))
        gap = gap_of(sweep)
    if gap is None or not gap.closes:
        return None
    closures = (sweep.lengths - sweep.lengths[0]) @ sweep.per_length
    kept = rising(closures)
    references, closures, openings_m = np.linspace(0.0, 1.0, len(closures))[kept], closures[kept], gap.sizes_m[kept]
    way = sweep.controls[-1] - sweep.controls[0]
    shares = (np.array([lower, upper]) - sweep.controls[0])[:, way != 0.0] / way[way != 0.0]
    ends = min(float(shares.min(axis=0).max()), 0.0), max(float(shares.max(axis=0).min()), 1.0)
    lag_s, force_lead, opening_force_lead = _servo(model, actuators, sweep)
    most = min(ends[1], 1.0 + LEAD)
    run = space.close(sweep, most, lag_s, force_lead)
    whole_lag_s, alone = resistance(run, references, closures, openings_m)
    told, weighed = np.linspace(0.0, most, _WEIGHED), [np.zeros(len(closures))]
    for weight in space.weights(gap.closing):
        rests = [space.rest(sweep, told, way) for way in (weight, -weight)]
        weighed.append(np.array([sags(one, told, references, closures, openings_m) for one in rests]).max(axis=0))
    # However the hand is turned.
    alone = np.maximum(alone, np.linalg.norm(weighed, axis=0))
    return GripperTravel(
        open_control=sweep.controls[0],
        closed_control=sweep.controls[-1],
        open_fingers=sweep.fingers[0],
        closed_fingers=sweep.fingers[-1],
        open_lengths=sweep.lengths[0],
        per_length=sweep.per_length,
        references=references,
        closures=closures,
        openings_m=openings_m,
        resists=min(_RESISTS, 0.5 * force_lead) + _SAFELY * alone,
        ends=ends,
        lags_s=(lag_s, max(lag_s, whole_lag_s)),
        force_lead=force_lead,
        opening_force_lead=opening_force_lead,
        ahead_m=sweep.ahead_m,
        closing=gap.closing,
        jaws=gap.jaws,
    )


def _servo(model: Any, actuators: IntArray, sweep: GripperSweep) -> tuple[float, float, float]:
    """Return the lag by the servos' own damping, in seconds, and both leads, `force_lead` first.

    sweep: from open to closed. force = gain u + offset - stiffness l - damping dl/dt
    """
    gain, limited = model.actuator_gainprm[actuators, 0], model.actuator_forcelimited[actuators].astype(bool)
    offset, stiffness, damping = (model.actuator_biasprm[actuators, :3] * (1.0, -1.0, -1.0)).T
    lowest, highest = np.where(limited, model.actuator_forcerange[actuators].T, [[-np.inf], [np.inf]])
    # Springs load the drive at rest: a servo that only pulls opens by what it gives less.
    resting = np.clip(gain * sweep.controls + offset - stiffness * sweep.lengths, lowest, highest)
    each = gain * (sweep.controls[-1] - sweep.controls[0])
    ends = np.full((2, *resting.shape), np.inf)
    np.divide([lowest - resting, highest - resting], each, out=ends, where=each != 0.0)
    opening, closing = np.abs(np.sort(ends, axis=0)).max(axis=1).min(axis=1)
    lags = np.divide(damping, stiffness, out=np.zeros_like(damping), where=stiffness > 0.0)
    return float(lags.max()), float(closing), float(opening)


def candidate_ends(lower: FloatArray, upper: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return the possible pairs of inputs (g,) at the two ends of the travel, from the actuators' ranges (g,).

    Two actuators may run in the same or in opposite directions; more than two are assumed to run in the same direction.
    """
    count = lower.size
    choices = product((False, True), repeat=count - 1) if count <= 2 else [(False,) * (count - 1)]
    swapped = [np.array((False, *choice)) for choice in choices]
    return [(np.where(swap, upper, lower), np.where(swap, lower, upper)) for swap in swapped]


def rising(closures: FloatArray) -> IntArray:
    """Return the indices of samples whose `closures` (k,) rise.

    Where inputs move nothing, the last of them counts, from which the fingers move on; at the end the first one, as
    fingers that press on each other stop before the last input.
    """
    highest = np.maximum.accumulate(closures)
    before = np.flatnonzero(closures[1:] > highest[:-1] + _FLAT)
    return np.append(before, before[-1:] + 1)


def closed_from(closures: FloatArray, openings_m: FloatArray) -> float:
    """Return the closure from which on a gripper with these samples (k,) counts as closed."""
    first = int(np.argmax(openings_m <= openings_m[-1] + NOTHING_M))
    low, high = max(first - 1, 0), first
    share = np.interp(-(openings_m[-1] + NOTHING_M), -openings_m[[low, high]], [0.0, 1.0])
    return max(float(closures[low] + share * (closures[high] - closures[low])), float(closures[-1]) - _CLOSED)


def resistance(
    run: ClosingRun, references: FloatArray, closures: FloatArray, openings_m: FloatArray
) -> tuple[float, FloatArray]:
    """Return the drive's lag in seconds, and how far (k,) fingers that rest lag beyond it at the samples, in `run`.

    references, closures, openings_m (k,): the samples, at rest.
    """
    behind = run.references - np.interp(run.closures, closures, references)
    fast = (run.speeds > 0.5 * run.speeds.max()) & (run.closures > 0.1) & (run.closures < 0.9)
    lag_s = max(float(np.median(behind[fast] / run.speeds[fast])), 0.0) if fast.any() else 0.0
    alone = (np.abs(run.speeds) < 2.0 * STANDING_SPEED_1_S) & (run.closures < closed_from(closures, openings_m))
    # For as long as fingers have to rest; they also rest as they begin to move.
    steps = round(STANDING_TIME_S / run.step_s)
    lasts = sliding_window_view(np.where(alone, behind - lag_s * run.speeds, 0.0), steps).min(axis=1)
    return lag_s, _beside(closures, run.closures[steps - 1 :], lasts)


def sags(
    rests: FloatArray, told: FloatArray, references: FloatArray, closures: FloatArray, openings_m: FloatArray
) -> FloatArray:
    """Return how far (k,) fingers under their weight, at `rests` (n,) if `told` (n,), lag at the samples."""
    free = rests < closed_from(closures, openings_m)
    leads, order = np.where(free, told - np.interp(rests, closures, references), 0.0), rests.argsort()
    # Where the whole weight lets nothing rest, a part of it does.
    return np.maximum(_beside(closures, rests, leads), np.interp(closures, rests[order], leads[order]))


def _beside(closures: FloatArray, at: FloatArray, leads: FloatArray) -> FloatArray:
    """Return the greatest of `leads` (n,), which are at the closures `at` (n,), beside each sample (k,), or 0.

    Each sample stands for the travel on both of its sides.
    """
    from_to = zip([-np.inf, *closures[:-1]], [*closures[1:], np.inf], strict=True)
    return np.array([leads[(at >= low) & (at <= high)].max(initial=0.0) for low, high in from_to])


def open_gap(scene: Simulated, cover: GripperCover) -> tuple[float, float] | None:
    """Return the gap between the jaws of the open gripper, and what of it their spheres leave, in m.

    None without fingers.
    """
    travel, model = measure_gripper(scene), scene.model
    if travel is None:
        return None
    data = opened(model, scene.robot, scene.data.qpos, travel)
    ends_m = jaw_places_m(data, travel)
    gap_m = float(np.linalg.norm(ends_m[1] - ends_m[0]))
    way, kept_m = (ends_m[1] - ends_m[0]) / gap_m, gap_m
    for jaw, end_m, inward in zip(travel.jaws, ends_m, (way, -way), strict=True):
        own = cover.bodies == jaw.body
        centers_m = data.xpos[jaw.body] + cover.centers_m[own] @ data.xmat[jaw.body].reshape(3, 3).T
        from_surface_m = centers_m - end_m - patch_m(way)[:, None]
        along_m = from_surface_m @ inward
        beside_m2 = np.sum(from_surface_m**2, axis=2) - along_m**2
        reach_m = along_m + np.sqrt(np.maximum(cover.radii_m[own] ** 2 - beside_m2, 0.0))
        kept_m -= float(reach_m[beside_m2 < cover.radii_m[own] ** 2].max(initial=0.0))
    return gap_m, max(kept_m, 0.0)


def opened(model: Any, robot: RobotModel, configuration: FloatArray, travel: GripperTravel) -> Any:
    """Return the state, an MjData, of the robot at `configuration` (nq,) with its gripper open."""
    data = mujoco.MjData(model)
    data.qpos[:] = configuration
    data.qpos[robot.finger_positions] = travel.open_fingers
    mujoco.mj_kinematics(model, data)
    return data


def jaw_places_m(data: Any, travel: GripperTravel) -> tuple[FloatArray, FloatArray]:
    """Return the places (3,) of both jaws' surfaces, in the world, in the state `data`."""
    first_m, second_m = (data.xpos[jaw.body] + data.xmat[jaw.body].reshape(3, 3) @ jaw.point_m for jaw in travel.jaws)
    return first_m, second_m
