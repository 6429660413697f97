"""Point between the fingertips of a brought robot's hand, to which its tool's site is moved."""

import math
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel, jaw_places_m, opened
from robot_side.drivers.mujoco.hand.gripper_gap import AWAY_M, INSIDE_M, convex_geoms
from robot_side.drivers.mujoco.robot_model import RobotModel, put_site

_ASIDE_M: Final = 0.005
"""Distance across the hand up to which a site stays where it is, if it is not farther than `AWAY_M` in all"""
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
    data = opened(model, robot, start, travel)
    by_m, aside_m = _between(model, data, robot, travel)
    away_m = float(np.linalg.norm(by_m))
    if away_m <= AWAY_M and abs(aside_m) <= _ASIDE_M:
        return 0.0
    turn = data.xmat[model.site_bodyid[robot.site]].reshape(3, 3)
    put_site(model, robot.site, model.site_pos[robot.site] + turn.T @ by_m)
    return away_m


def closing_direction(data: Any, robot: RobotModel, travel: GripperTravel) -> FloatArray:
    """Return the direction (3,) across the tool, in the world, along which the fingers close."""
    across = np.array([*travel.closing[:2], 0.0])
    closing: FloatArray = data.site_xmat[robot.site].reshape(3, 3) @ (across / np.linalg.norm(across))
    return closing


def still_side(travel: GripperTravel) -> float:
    """Return 1 or -1 if only the jaw ahead or behind along `closing_direction` stands still, else 0."""
    first, second = travel.jaws
    return float(first.moves) - float(second.moves)


def rooms_m(
    model: Any, data: Any, robot: RobotModel, from_m: FloatArray, closing: FloatArray, most_m: float, into_m: float
) -> tuple[float, float]:
    """Return the room for a grasped object on either side of `from_m` (3,), at most `most_m`: against, along `closing`.

    The object reaches by `into_m` into the hand; it is looked for at three points.
    """
    into = data.site_xmat[robot.site].reshape(3, 3)[:, 2]
    points_m, rooms = from_m - np.outer([0.0, 0.5 * into_m, into_m], into), [most_m, most_m]
    for geom, solid in convex_geoms(model, robot.gripper_geoms).items():
        body = int(model.geom_bodyid[geom])
        turn = data.xmat[body].reshape(3, 3)
        for side, way in enumerate((-closing, closing)):
            enters_m, leaves_m = solid.spans_m((points_m - data.xpos[body]) @ turn, way @ turn)
            ahead_m = np.where(leaves_m >= 0.0, np.maximum(enters_m, 0.0), np.inf)
            rooms[side] = min(rooms[side], float(ahead_m.min()))
    return rooms[0], rooms[1]


def _between(model: Any, data: Any, robot: RobotModel, travel: GripperTravel) -> tuple[FloatArray, float]:
    """Return the way (3,), in the world, from the site to midway between the open fingers, inside their ends; and how
    much of it is across the hand, in m.

    If only one jaw moves, the way ends near the other one instead.
    """
    site_m, approach = data.site_xpos[robot.site].copy(), data.site_xmat[robot.site].reshape(3, 3)[:, 2].copy()
    closing, apart_m, still = closing_direction(data, robot, travel), float(travel.openings_m[0]), still_side(travel)
    across_m = float((np.mean(jaw_places_m(data, travel), axis=0) - site_m) @ closing)
    middle_m = across_m * closing + (travel.ahead_m - INSIDE_M) * approach
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
