"""Point between the fingertips of a brought robot's hand, to which its tool's site is moved."""

from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel, nearest_points
from robot_side.drivers.mujoco.mesh_arrays import geom_points
from robot_side.drivers.mujoco.robot_model import RobotModel, put_site

_INSIDE_M: Final = 0.015
"""Distance of the tool from the ends of the fingertips, as in the built-in arm"""
_AWAY_M: Final = 0.02
"""Distance up to which a site stays where it is: a person grasps as far past the tool's point"""
_INTO_M: Final = 0.02
"""Distance from the tool's point, into the hand, over which a grasped object needs room"""


def move_site(model: Any, robot: RobotModel, start: FloatArray, travel: GripperTravel) -> float:
    """Move the site between the open fingers, near their tips, if it is far from there; return by how much, in m."""
    data = mujoco.MjData(model)
    data.qpos[:] = start
    by_m = _between(model, data, robot, travel)
    away_m = float(np.linalg.norm(by_m))
    if away_m <= _AWAY_M:
        return 0.0
    turn = data.xmat[model.site_bodyid[robot.site]].reshape(3, 3)
    put_site(model, robot.site, model.site_pos[robot.site] + turn.T @ by_m)
    return away_m


def closing_direction(model: Any, data: Any, robot: RobotModel, travel: GripperTravel) -> FloatArray:
    """Return the direction (3,) across the tool, in the world, along which the fingers close; leave them open."""
    middles_m = []
    for fingers in (travel.closed_fingers, travel.open_fingers):
        data.qpos[robot.finger_positions] = fingers
        mujoco.mj_kinematics(model, data)
        middles_m.append(data.geom_xpos[robot.gripper_geoms])
    across = data.site_xmat[robot.site].reshape(3, 3)[:, :2]
    moved_m = np.subtract(*middles_m) @ across
    closing: FloatArray = across @ np.linalg.eigh(moved_m.T @ moved_m)[1][:, -1]
    return closing


def room_m(model: Any, data: Any, robot: RobotModel, from_m: FloatArray, way: FloatArray, most_m: float) -> float:
    """Return the distance along the unit vector `way` to the hand, at most `most_m`.

    It is the least one from points between `from_m` (3,) and the depth to which a grasped object reaches into the hand.
    """
    approach, hit = data.site_xmat[robot.site].reshape(3, 3)[:, 2], np.zeros(1, dtype=np.int32)
    for depth_m in (0.0, _INTO_M):
        away_m = mujoco.mj_ray(model, data, from_m - depth_m * approach, way, None, 1, -1, hit)
        if away_m >= 0.0 and model.geom_bodyid[hit[0]] in model.geom_bodyid[robot.gripper_geoms]:
            most_m = min(most_m, away_m)
    return most_m


def _between(model: Any, data: Any, robot: RobotModel, travel: GripperTravel) -> FloatArray:
    """Return the way (3,), in the world, from the site to midway between the fingers, inside their ends.

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
    across_m = float((nearest_points(model, data, robot, apart_m).mean(axis=0) - site_m) @ closing)
    middle_m = across_m * closing + (max(ends_m) - _INSIDE_M) * approach
    left_m, right_m = (room_m(model, data, robot, site_m + middle_m, way, 0.5 * apart_m) for way in (-closing, closing))
    between_m: FloatArray = middle_m + 0.5 * (right_m - left_m) * closing
    return between_m
