"""Find placements of objects in which a recorded approach collides, and the last release that avoids the contact."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.approaches.replay import Replay
from robot_side.drivers.mujoco.posed_scene import PosedScene

_FASTEST_M_S = 0.45
"""Upper bound on the speed of any part of the gripper, in m/s: 0.25 ahead, 0.1 across, and 0.5 rad/s at 0.16 m."""
_LEAST_STEP_S = 0.002
_LEAST_START_GAP_M = 0.015
_ACROSS_M = 0.01
"""Largest shift of the objects across the approach, in metres, to each side and up or down."""
_FARTHEST_M = 1.0
_ALONG_M = 0.1
"""Largest shift of the objects along the approach, in metres, where nothing is straight ahead."""
_TRIES = 40


@dataclass(frozen=True)
class Collision:
    """One placement of the objects in which the approach collides, and the contact."""

    shift_m: FloatArray
    """(3,) shift of the objects from their places in the scene, when the pull begins"""
    touch_s: float
    """Time at which the true gripper touches something if the pull continues"""
    last_release_s: float | None
    """Latest time, at the operator side, of a release that avoids the contact; None if no release does."""


def shifted(shift_m: FloatArray, replay: Replay, speed_m_s: float, time_s: float) -> FloatArray:
    """Return the shift (3,) of objects at `time_s`: `shift_m`, and their way since the pull began at `speed_m_s`."""
    moved: FloatArray = shift_m + speed_m_s * max(time_s - replay.record.began_s, 0.0) * replay.axis
    return moved


def place(
    replay: Replay, posed: PosedScene, generator: np.random.Generator, speed_m_s: float = 0.0
) -> Collision | None:
    """Draw a placement of the objects in which the approach collides; None if 40 draws find none or the pull is short.

    The place of the contact is uniform over the length of the tool's path, with its drift and turning. speed_m_s: speed
    of the objects along the approach axis as the pull begins; below 0 they come nearer.
    """
    record = replay.record
    posed.set_pose(*_pose(replay, record.began_s), np.zeros(3))
    home_distance_m = posed.contact_distance_m(_FARTHEST_M)
    farthest_m = float(np.interp(replay.end_s, record.pose_time_s, replay.along_m))
    if farthest_m <= _LEAST_START_GAP_M:
        return None
    across = np.linalg.svd(replay.axis[None, :])[2][1:]
    for _ in range(_TRIES):
        row = int(np.argmax(replay.along_m >= float(generator.uniform(_LEAST_START_GAP_M, farthest_m))))
        aside = generator.uniform(-_ACROSS_M, _ACROSS_M, 2) @ across
        if home_distance_m < _FARTHEST_M:
            shift_m = replay.moved_m[row] - home_distance_m * replay.axis + aside
        else:
            # Nothing is straight ahead: drift or turning leads to the objects.
            shift_m = generator.uniform(-_ALONG_M, _ALONG_M) * replay.axis + aside
        posed.set_pose(*_pose(replay, record.began_s), shift_m)
        if posed.gap_m() < _LEAST_START_GAP_M:
            continue
        touch_s = first_touch_s(replay, posed, shift_m, speed_m_s)
        if touch_s is not None:
            last_s = last_release_s(replay, posed, shift_m, touch_s, speed_m_s)
            return Collision(shift_m, touch_s, last_s)
    return None


def first_touch_s(replay: Replay, posed: PosedScene, shift_m: FloatArray, speed_m_s: float = 0.0) -> float | None:
    """Return when the true gripper first touches the objects moved by `shift_m` (3,); None if it never does."""
    time_s = replay.record.began_s
    while time_s <= replay.end_s:
        posed.set_pose(*_pose(replay, time_s), shifted(shift_m, replay, speed_m_s, time_s))
        gap_m = posed.gap_m()
        if gap_m <= 0.0:
            return time_s
        time_s += max(gap_m / (_FASTEST_M_S + abs(speed_m_s)), _LEAST_STEP_S)
    return None


def last_release_s(
    replay: Replay, posed: PosedScene, shift_m: FloatArray, touch_s: float, speed_m_s: float = 0.0
) -> float | None:
    """Return the time of the last release that avoids the contact, to 2 ms; None if no release since the pull does.

    The time is found by bisection: no pull here moves back, so a later release never stops the arm earlier.
    """
    early_s, late_s = replay.record.began_s, touch_s
    if not avoids(replay, posed, shift_m, touch_s, early_s, speed_m_s):
        return None
    while late_s - early_s > _LEAST_STEP_S:
        middle_s = 0.5 * (early_s + late_s)
        if avoids(replay, posed, shift_m, touch_s, middle_s, speed_m_s):
            early_s = middle_s
        else:
            late_s = middle_s
    return early_s


def avoids(
    replay: Replay, posed: PosedScene, shift_m: FloatArray, touch_s: float, released_s: float, speed_m_s: float = 0.0
) -> bool:
    """Return whether the arm, stopped by a release at `released_s`, comes to rest before the objects."""
    stopped = replay.stopped_joints(released_s)
    if stopped is None or stopped[0] >= touch_s:
        return False
    arrives_s, rests_s, joints_rad = stopped
    _, fingers = _pose(replay, arrives_s)
    posed.set_pose(joints_rad, fingers, shifted(shift_m, replay, speed_m_s, rests_s))
    return posed.gap_m() > 0.0


def _pose(replay: Replay, time_s: float) -> tuple[FloatArray, FloatArray]:
    record = replay.record
    return replay.joints_at(time_s)[0], record.finger_positions[record.pose_row(time_s)]
