"""Built-in table in front of a robot that a person brought: where it stands, what room and target the hand needs."""

import contextlib
import math
from collections.abc import Iterator
from itertools import chain, islice, product
from typing import Any, Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.drivers.mujoco.brought.fingertips import (
    BESIDE_M,
    INTO_M,
    LOW_INTO_M,
    closing_direction,
    move_site,
    rooms_m,
    still_side,
)
from robot_side.drivers.mujoco.brought.reach import FROM_ABOVE, NEAR_M, go, grasp_places
from robot_side.drivers.mujoco.built_in_scenes import make_room
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel, measure_gripper, opened
from robot_side.drivers.mujoco.mesh_arrays import geom_points
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.robot_model import RobotModel, Simulated

_ABOVE_M: Final = 0.02
"""Least distance of the hand from the table, and, if it comes from above, from the target"""
_TURNED_RAD: Final = math.radians(20.0)
_DROPS_M: Final = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5)
_NEARER_M: Final = (0.0, 0.06, 0.11, 0.15, 0.18)
_SPANNED: Final = 0.6
"""Largest share of the open gripper's gap that the target fills"""
_LEVEL: Final = 0.5
"""Least horizontal part of the fingers' direction of closing at which the target turns"""
_TARGET_M: Final = (0.0315, 0.02, 0.06)
"""Half sizes of the built-in target"""
_THINNEST_M: Final = 0.005
_SLIMMEST: Final = 4.0
"""Largest ratio of the target's height to its thickness, beyond the built-in one's"""
_LOWEST_M: Final = 0.045
"""Least half height of the target: a hand from above grasps it 20 mm above its centre"""
_LOW_M: Final = 0.03
"""Half height of the target for a hand of which only one jaw moves: as that turns, it presses on a higher one's top"""
_SLIDES: Final = [0.3, 0.3, 0.01, 0.0005, 0.0005]
"""Friction of that target on the table, about as of wood on wood: at 1 it would tip over where a jaw pushes it"""
_IMPRATIO: Final = 30.0
"""Ratio at which the SO-101 places five of six targets; at 20 it places four (`feelahead try demo --seeds 6`)"""
_SAMPLES: Final = 2000
_MOST_STARTS: Final = 48
_FEWEST_JOINTS: Final = 5
"""Number of joints below which no start helps an arm to hold the tool's direction on the way"""
_LEAST_AHEAD_M: Final = 0.15
_MORE_M: Final = 1e-3
_LEAN: Final = 0.3
"""Largest vertical part of the fingers' direction of closing: the target is upright"""
_STRAIGHT: Final = 0.95
"""Cosine of the largest angle between the tool's approach and the way ahead, or down, at a start that is found"""
TABLE_PREFIX: Final = "table_scene/"
"""Prefix that MuJoCo requires for attached elements; objects are named without it"""


class TablePose(NamedTuple):
    """Pose of the table, relative to the robot at its start."""

    yaw_rad: float
    """Direction from the base to the tool, about the vertical"""
    nearer_m: float
    """Distance by which all objects are nearer to the robot than to the built-in arm"""
    top_m: float
    """Height of the table's top in the world"""


class Settled(NamedTuple):
    """Start of a robot at the table."""

    start: FloatArray
    """(nq,) configuration"""
    table: TablePose
    moved_m: float
    """Distance by which the tool's site was moved, so that it is between the fingertips"""
    found: bool
    """Whether the start was searched for, because from the given one the target is out of reach"""


def usual_table_pose(model: Any, robot: RobotModel, start: FloatArray) -> TablePose:
    """Return the pose of the built-in arm's table: its top at the base's height, the tool at home above it."""
    data = _placed(model, start)
    base_m, tool_m = data.xpos[robot.root_body], data.site_xpos[robot.site]
    ahead = tool_m[:2] - base_m[:2]
    # A tool right above the base has no direction.
    yaw_rad = math.atan2(ahead[1], ahead[0]) if np.hypot(*ahead) > 0.05 else 0.0
    return TablePose(yaw_rad, 0.0, float(base_m[2]))


def settle(table: Any, model: Any, robot: RobotModel, start: FloatArray, *, may_search: bool) -> Settled:
    """Give the hand room and a target that it can span; return where the robot and the table stand.

    The tool's site is moved between the fingertips if it is far from them.

    table: the MjSpec of the table's scene, which is changed. The table is at its usual place if the tool reaches the
    target there, else nearer or lower. may_search: whether another start may be searched for.
    """
    travel = _travel(model, robot, start)
    moved_m = 0.0 if travel is None else move_site(model, robot, start, travel)
    low = travel is not None and still_side(travel) != 0.0
    into_m = LOW_INTO_M if low else INTO_M
    thick_m = math.inf if travel is None else _thickest_m(model, robot, start, travel, into_m)
    most = _MOST_STARTS if may_search and robot.arm_joints.size >= _FEWEST_JOINTS else 0
    for number, tried in enumerate(chain([start], islice(_other_starts(model, robot, start), most))):
        fit_target(table, thick_m, 0.0 if travel is None else _lean(model, robot, tried, travel), low=low)
        if (found := _find_table_pose(table, model, robot, tried, travel)) is not None:
            settled = Settled(tried, found, moved_m, number > 0)
            break
    else:
        fit_target(table, thick_m, low=low)
        settled = Settled(start, usual_table_pose(model, robot, start), moved_m, found=False)
    if travel is not None:
        closing = closing_direction(_placed(model, settled.start), robot, travel)
        _turn_target(table, closing, settled.table.yaw_rad)
    make_room(table, *hand_reach_m(model, robot, settled.start, settled.table.yaw_rad)[:2])
    return settled


def fit_target(table: Any, thick_m: float, lean: float = 0.0, *, low: bool = False) -> None:
    """Make the target at most `thick_m` thick, and so low that it stands safely.

    lean: vertical part of the fingers' direction of closing; fingers askew need room beside an upright target. low:
    whether only one jaw moves.
    """
    target, body = table.geom("target"), table.body("target")
    most_m = max(0.5 * thick_m - lean * (_LOW_M if low else _TARGET_M[2]), _THINNEST_M)
    length_m, width_m = min(_TARGET_M[0], most_m), min(_TARGET_M[1], most_m)
    height_m = _LOW_M if low else min(_TARGET_M[2], max(_SLIMMEST * width_m, _LOWEST_M))
    target.size, body.pos = [length_m, width_m, height_m], [*body.pos[:2], height_m]
    if low and not table.pairs:
        table.add_pair(geomname1="target", geomname2="table_top", friction=_SLIDES)


def _find_table_pose(
    table: Any, model: Any, robot: RobotModel, start: FloatArray, travel: GripperTravel | None
) -> TablePose | None:
    """Return the first pose of the table at which the tool reaches the target from `start`; None if there is none.

    None if the fingers close upwards, too: the target is upright.
    """
    if travel is not None and _lean(model, robot, start, travel) > _LEAN:
        return None
    data, usual = _placed(model, start), usual_table_pose(model, robot, start)
    tool_m, approach = data.site_xpos[robot.site], data.site_xmat[robot.site].reshape(3, 3)[:, 2]
    lowest_m = tool_m[2] - hand_reach_m(model, robot, start, usual.yaw_rad)[2]
    from_target_m = np.array(table.body("target").pos) - np.array([*table.site("tool_home").pos[:2], 0.0])
    height_m = 2.0 * from_target_m[2] if approach[2] < FROM_ABOVE else 0.0
    if approach[2] > -FROM_ABOVE:
        return None
    for top_m, nearer_m in product((usual.top_m, *(tool_m[2] - drop_m for drop_m in _DROPS_M)), _NEARER_M):
        if lowest_m < top_m + height_m + _ABOVE_M:
            continue
        ahead_m = from_target_m[0] - nearer_m
        direction = np.array([math.cos(usual.yaw_rad), math.sin(usual.yaw_rad)])
        target_m = np.array([*(tool_m[:2] + ahead_m * direction), top_m + from_target_m[2]])
        gone = go(model, robot, start, grasp_places(tool_m, approach, target_m))
        if gone.left_m <= NEAR_M and gone.turned_rad <= _TURNED_RAD and gone.lowest_m >= top_m:
            return usual._replace(top_m=float(top_m), nearer_m=nearer_m)
    return None


def _other_starts(model: Any, robot: RobotModel, start: FloatArray) -> Iterator[FloatArray]:
    """Yield configurations (nq,) away from the joints' ends, in which the tool points ahead or down.

    The robot touches itself no more than at its start. They are drawn in the same order each time.
    """
    generator, data = np.random.default_rng(0), _placed(model, start)
    # The parts of many models penetrate each other everywhere.
    mujoco.mj_forward(model, data)
    deepest_m = float(data.contact.dist.min(initial=0.0))
    lower = np.where(np.isfinite(robot.lower_rad), robot.lower_rad, -math.pi)
    upper = np.where(np.isfinite(robot.upper_rad), robot.upper_rad, math.pi)
    for _ in range(_SAMPLES):
        data.qpos[:] = start
        data.qpos[robot.arm_positions] = lower + (upper - lower) * generator.uniform(0.2, 0.8, lower.size)
        mujoco.mj_kinematics(model, data)
        out = data.site_xpos[robot.site] - data.xpos[robot.root_body]
        level, approach = np.array([*out[:2], 0.0]), data.site_xmat[robot.site].reshape(3, 3)[:, 2]
        far_m = float(np.linalg.norm(level))
        if far_m < _LEAST_AHEAD_M or max(float(approach @ level) / far_m, -float(approach[2])) < _STRAIGHT:
            continue
        mujoco.mj_forward(model, data)
        if float(data.contact.dist.min(initial=0.0)) >= deepest_m - _MORE_M:
            yield data.qpos.copy()


def _travel(model: Any, robot: RobotModel, start: FloatArray) -> GripperTravel | None:
    """Return the gripper's travel; None without a gripper that can be measured."""
    with contextlib.suppress(ConfigurationError, mujoco.FatalError):
        return measure_gripper(Simulated(model, _placed(model, start), robot))
    return None


def _turn_target(table: Any, closing: FloatArray, yaw_rad: float) -> None:
    """Turn a face of the target towards fingers that close along `closing`; `yaw_rad` is the table's direction."""
    if np.hypot(*closing[:2]) < _LEVEL:
        return
    quarters = (math.atan2(closing[1], closing[0]) - yaw_rad) / (0.5 * math.pi)
    turn_rad = 0.5 * math.pi * (quarters - round(quarters))
    table.body("target").quat = [math.cos(0.5 * turn_rad), 0.0, 0.0, math.sin(0.5 * turn_rad)]


def _thickest_m(model: Any, robot: RobotModel, start: FloatArray, travel: GripperTravel, into_m: float) -> float:
    """Return how thick an object around the tool's point, that reaches by `into_m` into the hand, is grasped well.

    One jaw may be nearer to the point than the other.
    """
    data, most_m = opened(model, robot, start, travel), 0.5 * float(travel.openings_m[0])
    closing = closing_direction(data, robot, travel)
    clear_m = 2.0 * min(rooms_m(model, data, robot, data.site_xpos[robot.site], closing, most_m, into_m))
    return min(_SPANNED * clear_m, clear_m - 2.0 * BESIDE_M)


def _lean(model: Any, robot: RobotModel, start: FloatArray, travel: GripperTravel) -> float:
    """Return the vertical part of the direction along which the fingers close at the start."""
    return abs(float(closing_direction(_placed(model, start), robot, travel)[2]))


def hand_reach_m(model: Any, robot: RobotModel, start: FloatArray, yaw_rad: float) -> FloatArray:
    """Return how far (3,) the hand reaches from the tool's point: ahead along `yaw_rad`, to its sides, and down.

    The fingers are at the start, and at either end of their ranges.
    """
    if robot.gripper_geoms.size == 0:
        return np.zeros(3)
    data, geoms, fingers = mujoco.MjData(model), robot.gripper_geoms, robot.finger_positions
    of_position = {int(address): joint for joint, address in enumerate(model.jnt_qposadr)}
    ranges = model.jnt_range[[of_position[int(address)] for address in fingers]].reshape(-1, 2)
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    axes = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, -1.0]])
    reach_m: FloatArray = np.zeros(3)
    for placed in (start[fingers], *ranges.T):
        data.qpos[:] = start
        data.qpos[fingers] = placed
        mujoco.mj_kinematics(model, data)
        out_m = (geom_points(model, data, geoms) - data.site_xpos[robot.site]) @ axes.T
        out_m[:, 1] = np.abs(out_m[:, 1])
        reach_m = np.maximum(reach_m, out_m.max(axis=0))
    return reach_m


def attach(table: Any, spec: Any, model: Any, robot: RobotModel, start: FloatArray, pose: TablePose) -> None:
    """Attach the table's scene `table` to the robot's `spec`, at its pose."""
    tool_m = _placed(model, start).site_xpos[robot.site]
    home_x, home_y, _ = table.site("tool_home").pos
    if model.geom_type[model.geom_type == GeomKind.PLANE].size:
        table.delete(table.geom("floor"))
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    x, y = home_x + pose.nearer_m, home_y
    spec.attach(
        table,
        prefix=TABLE_PREFIX,
        frame=spec.worldbody.add_frame(
            pos=[tool_m[0] - (cos * x - sin * y), tool_m[1] - (sin * x + cos * y), pose.top_m],
            quat=[math.cos(pose.yaw_rad / 2.0), 0.0, 0.0, math.sin(pose.yaw_rad / 2.0)],
        ),
    )


def keep_from_slipping(spec: Any) -> None:
    """Let friction resist slip in a model that leaves MuJoCo's contacts as they are, as what it holds would slip.

    As MuJoCo's documentation advises against slip: elliptic friction cones, and a higher `impratio`.
    """
    option = spec.option
    if option.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL and option.impratio == 1.0 and option.noslip_iterations == 0:
        option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, _IMPRATIO


def _placed(model: Any, start: FloatArray) -> Any:
    data = mujoco.MjData(model)
    data.qpos[:] = start
    mujoco.mj_kinematics(model, data)
    return data
