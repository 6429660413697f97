"""A law's memory between ticks, and single calls of kernels that the law itself runs together in one call."""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.arm.ability import JointLimits
from robot_side.arm.port import GripperPose
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import BOOL, FLOAT64, INT64, compiled, input_array, output_array
from robot_side.compiled.vectors import load
from robot_side.laws import felt, fingers, path, recent_looks
from robot_side.laws.memory import Memory, memory_at


def memory(spheres: int = 0) -> Memory:
    """Return the initial memory of a law, with room for a gripper of `spheres` spheres."""
    made = Memory(JointLimits(np.ones(6), np.ones(6)), np.zeros(6), [np.zeros((0, 3))] * 2)
    made.make_room(max(spheres, 1), 1)
    made.prospect["stretch"] = 1.0
    return made


def moved(
    kept: Memory, pose: GripperPose, after_s: float, ahead_m: float = 0.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the tool's position (3,) and rotation (3, 3), and the spheres' centres (m, 3), predicted for `after_s`."""
    _move(kept.bundle, pose.tool_position_m, pose.tool_rotation, pose.sphere_centers_m, after_s, ahead_m)
    return kept.tool_m.copy(), kept.rotation.copy(), kept.centers_m[: len(pose.sphere_centers_m)].copy()


def moments(kept: Memory, pose: GripperPose, until_s: float, ahead_m: float = 0.0) -> tuple[float, ...]:
    """Return the times ahead, up to `until_s`, at which the gripper's predicted poses are to be looked from."""
    _plan(kept.bundle, pose.tool_position_m, pose.tool_rotation, pose.sphere_centers_m, until_s, ahead_m)
    return tuple(kept.moments_s[: kept.state["even_places"][0]].tolist())


def farthest_m_s(kept: Memory, pose: GripperPose, ahead_m: float) -> float:
    """Return the largest speed of all spheres, where they are and if they were `ahead_m` farther along the approach."""
    found: float = _farthest(kept.bundle, pose.tool_position_m, pose.tool_rotation, pose.sphere_centers_m, ahead_m)
    return found


def fingers_m_s(kept: Memory, pose: GripperPose, now_s: float, *, changed: bool = False) -> FloatArray:
    """Measure the spheres at one more pose; return their velocities (m, 3) relative to the tool."""
    _measure(kept.bundle, pose.sphere_centers_m, pose.tool_position_m, pose.tool_rotation, now_s, changed)
    return kept.own_m_s.copy()


@compiled(BUNDLE, input_array(1), input_array(2), input_array(2), FLOAT64, FLOAT64)
def _move(
    bundle: IntArray, tool: FloatArray, rotation: FloatArray, centers: FloatArray, after: float, ahead: float
) -> None:
    velocity = load(memory_at(bundle).velocity, 0), load(memory_at(bundle).velocity, 1)
    path.move(bundle, load(tool.reshape(1, 3), 0), rotation, centers, *velocity, after, ahead)


@compiled(BUNDLE, input_array(1), input_array(2), input_array(2), FLOAT64, FLOAT64)
def _plan(
    bundle: IntArray, tool: FloatArray, rotation: FloatArray, centers: FloatArray, until: float, ahead: float
) -> None:
    approach = rotation[0, 2], rotation[1, 2], rotation[2, 2]
    path.plan_places(bundle, centers, load(tool.reshape(1, 3), 0), approach, until, ahead)


@compiled(BUNDLE, input_array(1), input_array(2), input_array(2), FLOAT64, returns=FLOAT64)
def _farthest(bundle: IntArray, tool: FloatArray, rotation: FloatArray, centers: FloatArray, ahead: float) -> float:
    farther = ahead * rotation[0, 2], ahead * rotation[1, 2], ahead * rotation[2, 2]
    return path.fastest_m_s(bundle, centers, load(tool.reshape(1, 3), 0), farther)


@compiled(BUNDLE, input_array(2), input_array(1), input_array(2), FLOAT64, BOOL)
def _measure(
    bundle: IntArray, centers: FloatArray, tool: FloatArray, rotation: FloatArray, now: float, changed: bool
) -> None:
    fingers.measure_fingers(bundle, centers, load(tool.reshape(1, 3), 0), rotation, now, changed)


@compiled(BUNDLE, INT64, INT64)
def look_from(bundle: IntArray, side: int, places: int) -> None:
    recent_looks.look_from(bundle, side, places)


@compiled(BUNDLE, INT64, INT64, FLOAT64, input_array(1), input_array(2))
def keep(bundle: IntArray, side: int, place: int, now: float, tool: FloatArray, ways: FloatArray) -> None:
    recent_looks.keep(bundle, side, place, now, load(tool.reshape(1, 3), 0), ways)


@compiled(BUNDLE, input_array(2), FLOAT64, BOOL, FLOAT64, output_array(1))
def feel(
    bundle: IntArray, where: FloatArray, loop_age: float, is_known: bool, deflection: float, numbers: FloatArray
) -> None:
    """Run the kernel `felt.feel`. Rows of `where` (3, 3): the tool's position, its approach axis, and its velocity."""
    tool = load(where, 0), load(where, 1), load(where, 2)
    felt.feel(bundle, *tool, loop_age, is_known, deflection, numbers)
