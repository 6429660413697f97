"""Point between the fingertips of a brought robot's hand, to which its tool's site is moved."""

import math
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.drivers.mujoco.gripper_cover import placed_corners
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel, nearest_pair
from robot_side.drivers.mujoco.mesh_arrays import geom_points
from robot_side.drivers.mujoco.robot_model import RobotModel, put_site

_INSIDE_M: Final = 0.015
"""Distance of the tool from the ends of the fingertips, as in the built-in arm"""
_AWAY_M: Final = 0.02
_ASIDE_M: Final = 0.005
"""Distances up to which a site stays: in all, as a person grasps as far past the tool's point; and across the hand"""
BESIDE_M: Final = 0.013
"""Least room between the target and each finger: 3 mm by which the spheres protrude, and 10 mm of the arm's and the
camera's errors at the usual probability"""
_NEAR_M: Final = 0.033
"""Largest distance of the tool's point from a jaw that stands still while the other one closes: the other one pushes an
object against it. The built-in target's half width fits, and `BESIDE_M`"""
_ASKEW_RAD: Final = math.radians(45.0)
"""Angle from its closed position beyond which a jaw that turns pushes an object rather out of the hand than across"""
_HAND_M: Final = 0.2
"""Room between two jaws, of which one turns, if there is nothing on one side"""
_STILL_M: Final = 1e-3
INTO_M: Final = 0.04
LOW_INTO_M: Final = 0.01
"""Distances from the tool's point, into the hand, over which a grasped object needs room: usually, and for a low one"""


def move_site(model: Any, robot: RobotModel, start: FloatArray, travel: GripperTravel) -> float:
    """Move the site between the open fingers, near their tips, if it is far from there; return by how much, in m."""
    data = mujoco.MjData(model)
    data.qpos[:] = start
    by_m, aside_m = _between(model, data, robot, travel)
    away_m = float(np.linalg.norm(by_m))
    if away_m <= _AWAY_M and abs(aside_m) <= _ASIDE_M:
        return 0.0
    turn = data.xmat[model.site_bodyid[robot.site]].reshape(3, 3)
    put_site(model, robot.site, model.site_pos[robot.site] + turn.T @ by_m)
    return away_m


def closing_direction(model: Any, data: Any, robot: RobotModel, travel: GripperTravel) -> FloatArray:
    """Return the direction (3,) across the tool, in the world, along which the fingers close; leave them open."""
    moved_m = _closing_motions_m(model, data, robot, travel)
    across = data.site_xmat[robot.site].reshape(3, 3)[:, :2]
    moved_across_m = moved_m @ across
    closing: FloatArray = across @ np.linalg.eigh(moved_across_m.T @ moved_across_m)[1][:, -1]
    return closing


def still_side(model: Any, data: Any, robot: RobotModel, travel: GripperTravel, closing: FloatArray) -> float:
    """Return 1 or -1 if only the jaw ahead or behind along `closing` stands still, else 0; leave the fingers open."""
    moved_m = _closing_motions_m(model, data, robot, travel) @ closing
    signs = np.sign(moved_m[np.abs(moved_m) > _STILL_M])
    return float(signs[0]) if signs.size > 0 and (signs == signs[0]).all() else 0.0


def _closing_motions_m(model: Any, data: Any, robot: RobotModel, travel: GripperTravel) -> FloatArray:
    """Return how far each of the gripper's geoms (g, 3) moves, in the world, as the fingers close; leave them open."""
    places_m = []
    for fingers in (travel.closed_fingers, travel.open_fingers):
        data.qpos[robot.finger_positions] = fingers
        mujoco.mj_kinematics(model, data)
        places_m.append(data.geom_xpos[robot.gripper_geoms])
    motions_m: FloatArray = np.subtract(*places_m)
    return motions_m


def room_m(corners_m: FloatArray, from_m: FloatArray, way: FloatArray, most_m: float, *, into: FloatArray) -> float:
    """Return the distance along the unit vector `way` to the triangles `corners_m` (t, 3, 3), at most `most_m`.

    It is the least one from the points `from_m` (3,), `from_m + into`, and midway.
    """
    one, other = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    across = np.cross(way, other)
    scale = (one * across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        for part in (0.0, 0.5, 1.0):
            # Shares of both edges at the place where the ray crosses a triangle's plane, and the way to there.
            back = from_m + part * into - corners_m[:, 0]
            turned = np.cross(back, one)
            first, second = (back * across).sum(axis=1) / scale, turned @ way / scale
            away_m = (other * turned).sum(axis=1) / scale
            hits = (first >= 0.0) & (second >= 0.0) & (first + second <= 1.0) & (away_m >= 0.0)
            most_m = min(most_m, float(away_m[hits].min(initial=np.inf)))
    return most_m


def rooms_m(
    model: Any, data: Any, robot: RobotModel, from_m: FloatArray, closing: FloatArray, most_m: float, into_m: float
) -> tuple[float, float]:
    """Return the room for a grasped object on either side of `from_m` (3,), at most `most_m`: against, along `closing`.

    The object reaches by `into_m` into the hand.
    """
    hand = placed_corners(model, data, robot.gripper_geoms)
    into = -into_m * data.site_xmat[robot.site].reshape(3, 3)[:, 2]
    return room_m(hand, from_m, -closing, most_m, into=into), room_m(hand, from_m, closing, most_m, into=into)


def _between(model: Any, data: Any, robot: RobotModel, travel: GripperTravel) -> tuple[FloatArray, float]:
    """Return the way (3,), in the world, from the site to midway between the fingers, inside their ends; and how much
    of it is across the hand, in m.

    If only one jaw moves, the way ends near the other one instead.
    The ends are those of the open fingers, or of the closed ones if these reach farther. `data` is left open.
    """
    fingers, ends_m = robot.gripper_geoms[robot.geom_on_finger], []
    for positions in (travel.closed_fingers, travel.open_fingers):
        data.qpos[robot.finger_positions] = positions
        mujoco.mj_kinematics(model, data)
        site_m, approach = data.site_xpos[robot.site], data.site_xmat[robot.site].reshape(3, 3)[:, 2]
        ends_m.append(float(((geom_points(model, data, fingers) - site_m) @ approach).max()))
    closing = closing_direction(model, data, robot, travel)
    apart_m = float(travel.openings_m[0])
    ends = np.zeros(6)
    mujoco.mj_geomDistance(model, data, *nearest_pair(model, data, robot, apart_m), 2.0 * apart_m, ends)
    across_m = float((ends.reshape(2, 3).mean(axis=0) - site_m) @ closing)
    middle_m = across_m * closing + (max(ends_m) - _INSIDE_M) * approach
    still = still_side(model, data, robot, travel, closing)
    reach_m = (0.5 * apart_m, INTO_M) if still == 0.0 else (_HAND_M, LOW_INTO_M)
    rooms = rooms_m(model, data, robot, site_m + middle_m, closing, *reach_m)
    if still == 0.0:
        aside_m = 0.5 * (rooms[1] - rooms[0])
    else:
        to_still_m = rooms[1] if still > 0.0 else rooms[0]
        data.qpos[robot.finger_positions] = _across(model, data, robot, travel)
        mujoco.mj_kinematics(model, data)
        beside_m = site_m + middle_m + still * (to_still_m - _STILL_M) * closing
        room = rooms_m(model, data, robot, beside_m, closing, *reach_m)[0 if still > 0.0 else 1]
        aside_m = still * (to_still_m - min(_NEAR_M, 0.5 * (room + BESIDE_M)))
    between_m: FloatArray = middle_m + aside_m * closing
    return between_m, across_m + aside_m


def _across(model: Any, data: Any, robot: RobotModel, travel: GripperTravel) -> FloatArray:
    """Return the fingers' widest positions (f,) at which no jaw is turned too far to push an object across the hand."""
    turns = []
    for fingers in (travel.closed_fingers, travel.open_fingers):
        data.qpos[robot.finger_positions] = fingers
        mujoco.mj_kinematics(model, data)
        turns.append(Rotation.from_matrix(data.geom_xmat[robot.gripper_geoms].reshape(-1, 3, 3)))
    turned_rad = float((turns[0].inv() * turns[1]).magnitude().max())
    share = _ASKEW_RAD / max(turned_rad, _ASKEW_RAD)
    across: FloatArray = travel.closed_fingers + share * (travel.open_fingers - travel.closed_fingers)
    return across
