"""Reach of an arm: its tool moved along straight ways, without time and forces."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.drivers.mujoco.mesh_arrays import geom_points
from robot_side.drivers.mujoco.robot_model import RobotModel, can_touch

NEAR_M: Final = 0.01
"""Distance from a place within which the tool has reached it"""
FROM_ABOVE: Final = -0.5
"""Vertical part of the approach below which the hand comes from above"""
_PAST_M: Final = 0.02
"""Distance of the tool past the target's centre at a grasp; before the centre if the hand comes from above"""
_UP_M: Final = 0.1
_BACK_M: Final = 0.06
"""Distances by which the target is lifted, and carried back"""
_STEP_M: Final = 0.005
_STANDS_M: Final = 1e-4
_FASTEST: Final = 1e3


class Gone(NamedTuple):
    """End of a way."""

    left_m: float
    """Distance to the first place that the tool does not reach; to the last place if it reaches all"""
    place: int
    """Index of that place"""
    turned_rad: float
    """Angle by which the tool's approach has turned against the start"""
    lowest_m: float
    """Least height of the robot beyond its first link, at the start and at the places"""
    at_end: IntArray
    """Indices of the arm's joints that are at an end of their ranges"""


def grasp_places(tool_m: FloatArray, approach: FloatArray, target_m: FloatArray) -> tuple[FloatArray, ...]:
    """Return the tool's places (3,) on its way: in line with the target, at it, above, back, and down again."""
    grasp_m = target_m + (_PAST_M if approach[2] > FROM_ABOVE else -_PAST_M) * approach
    up_m, back_m = np.array([0.0, 0.0, _UP_M]), _BACK_M * np.array([-approach[0], -approach[1], 0.0])
    in_line_m = grasp_m - float((grasp_m - tool_m) @ approach) * approach
    return in_line_m, grasp_m, grasp_m + up_m, grasp_m + up_m + back_m, grasp_m + back_m


def go(model: Any, robot: RobotModel, start: FloatArray, places_m: Sequence[FloatArray]) -> Gone:
    """Move the tool from the configuration `start` (nq,) to one place (3,) after another, within the joints' ranges."""
    data, jacobian = mujoco.MjData(model), np.zeros((6, model.nv))
    data.qpos[:] = start
    joints, fastest = robot.arm_positions, np.full(robot.arm_joints.size, _FASTEST)
    mujoco.mj_kinematics(model, data)
    began = data.site_xmat[robot.site].reshape(3, 3)[:, 2].copy()
    moving = _moving_geoms(model, robot)
    left_m, reached, lowest_m = 0.0, 0, _lowest_m(model, data, moving)
    for place_m in places_m:
        before_m = np.inf
        while True:
            left = place_m - data.site_xpos[robot.site]
            left_m = float(np.linalg.norm(left))
            if left_m < _STANDS_M or left_m > before_m - _STANDS_M:
                break
            before_m = left_m
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], robot.site)
            twist = np.concatenate([left * min(1.0, _STEP_M / left_m), np.zeros(3)])
            moved = data.qpos[joints] + joint_velocities(jacobian[:, robot.arm_velocities], twist, fastest)
            data.qpos[joints] = np.clip(moved, robot.lower_rad, robot.upper_rad)
            mujoco.mj_kinematics(model, data)
        if left_m > NEAR_M:
            break
        reached, lowest_m = reached + 1, min(lowest_m, _lowest_m(model, data, moving))
    at, approach = data.qpos[joints], data.site_xmat[robot.site].reshape(3, 3)[:, 2]
    return Gone(
        left_m,
        min(reached, len(places_m) - 1),
        float(np.arccos(np.clip(approach @ began, -1.0, 1.0))),
        lowest_m,
        np.flatnonzero((at <= robot.lower_rad) | (at >= robot.upper_rad)),
    )


def _moving_geoms(model: Any, robot: RobotModel) -> IntArray:
    """Return the colliding geoms of the robot beyond its first link."""
    beyond = np.zeros(model.nbody, dtype=bool)
    # A body comes after its parent.
    for body in range(model.jnt_bodyid[robot.arm_joints[:2][-1]], model.nbody):
        beyond[body] = body == model.jnt_bodyid[robot.arm_joints[:2][-1]] or beyond[model.body_parentid[body]]
    geoms = np.flatnonzero(beyond[model.geom_bodyid])
    return geoms[[can_touch(model, int(geom)) for geom in geoms]].astype(np.int64)


def _lowest_m(model: Any, data: Any, geoms: IntArray) -> float:
    return float(geom_points(model, data, geoms)[:, 2].min(initial=np.inf))
