"""What moves the gripper besides a trigger: drift across, turning, and the fingers' own way. Where will it be by then?

What lies ahead of where the gripper is may not lie ahead of where it will be: the field is looked at from there, too.
"""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import COUNT, compiled, inlined, input_array
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract, unit
from robot_side.laws.memory import FINGER_POSES, MOST_PLACES, memory_at

SPACING_M: Final = 0.015
"""No sphere gets farther between two places: less than an inflated fingertip's sphere is wide. A gripper that would
need more places than the most has them farther apart."""
_LEAST_M: Final = 0.003
"""Smaller motions are ignored."""
_NOISE_M_S: Final = 0.015
"""Slower than this, fingers rest: their readings are noisy."""
_FINGERS_S: Final = 0.06
"""The time over which the fingers' speed is measured."""


@inlined
def fastest_m_s(bundle: IntArray, centers: FloatArray, tool: Vector, ahead: Vector) -> float:
    """|v + ω × r + its own| of the fastest sphere, or of one farther on by `ahead`, in m/s; NaN for what is none."""
    memory = memory_at(bundle)
    velocity, turning = load(memory.velocity, 0), load(memory.velocity, 1)
    fastest, check = 0.0, 0.0
    for i in range(centers.shape[0]):
        lever, alone = subtract(load(centers, i), tool), add(velocity, load(memory.own_m_s, i))
        near, far = norm(add(alone, cross(turning, lever))), norm(add(alone, cross(turning, add(lever, ahead))))
        fastest = max(fastest, near, far)
        # A maximum may hide what is no number.
        check += near + far
    return fastest if math.isfinite(check) else math.nan


@inlined
def plan_moments(
    bundle: IntArray, centers: FloatArray, tool: Vector, approach: Vector, until: float, ahead: float
) -> None:
    """Decide when to look from where the gripper will be: evenly in time, the last at `until`; never where it stays.

    ahead: so far ahead (m) it is to be looked as finely as near the gripper, which counts while it turns.
    """
    memory = memory_at(bundle)
    state, farthest = memory.state[0], until * fastest_m_s(bundle, centers, tool, scale(ahead, approach))
    state.moments = 0
    if farthest >= _LEAST_M and math.isfinite(farthest):
        state.moments = min(math.ceil(farthest / SPACING_M), MOST_PLACES)
    for number in range(state.moments):
        memory.moments_s[number] = until * (number + 1) / state.moments


@inlined
def _turned(vector: Vector, axis: Vector, sine: float, versine: float) -> Vector:
    """By an angle about a unit vector (Rodrigues): v + sin · a × v + (1 - cos) · a × (a × v)."""
    across = cross(axis, vector)
    return add(vector, add(scale(sine, across), scale(versine, cross(axis, across))))


@inlined
def move(bundle: IntArray, origin: Vector, rotation: FloatArray, centers: FloatArray, after: float) -> None:
    """Put the tool and its spheres where they will be after that time, had the trigger not moved them.

    origin, rotation (3, 3), centers (m, 3): where they are. After 0 s, exactly these.
    """
    memory = memory_at(bundle)
    turning, stays = load(memory.velocity, 1), after == 0.0
    axis, half = unit(turning), 0.5 * after * norm(turning)
    sine, versine = math.sin(2.0 * half), 2.0 * math.sin(half) ** 2
    moved = origin if stays else add(origin, scale(after, load(memory.velocity, 0)))
    for k in range(3):
        memory.tool_m[k] = moved[k]
        column = _turned((rotation[0, k], rotation[1, k], rotation[2, k]), axis, sine, versine)
        for row in range(3):
            memory.rotation[row, k] = column[row]
    for i in range(centers.shape[0]):
        center = load(centers, i)
        if not stays:
            lever = subtract(add(center, scale(after, load(memory.own_m_s, i))), origin)
            center = add(moved, _turned(lever, axis, sine, versine))
        for row in range(3):
            memory.centers_m[i, row] = center[row]


@compiled(BUNDLE, input_array(1), input_array(2), input_array(2), COUNT)
def go_to_place(bundle: IntArray, tool: FloatArray, rotation: FloatArray, centers: FloatArray, place: int) -> None:
    """Move to a place that is looked from, for people who look; bundle: the memory's; tool (3,)."""
    after = memory_at(bundle).moments_s[place - 1] if place > 0 else 0.0
    move(bundle, load(tool.reshape(1, 3), 0), rotation, centers, after)


@inlined
def measure_fingers(
    bundle: IntArray, centers: FloatArray, tool: Vector, rotation: FloatArray, now: float, changed: bool
) -> None:
    """Measure how the spheres (m, 3) move against the tool, by where they were; 0 for spheres that are new."""
    memory = memory_at(bundle)
    state, count = memory.state[0], centers.shape[0]
    oldest = 0
    while oldest < state.finger_poses and memory.finger_poses_s[oldest] < now - _FINGERS_S - 1e-9:
        oldest += 1
    if state.finger_poses - oldest == FINGER_POSES:
        oldest += 1
    kept = 0 if changed else state.finger_poses - oldest
    for pose in range(kept if oldest > 0 else 0):
        memory.finger_poses_s[pose] = memory.finger_poses_s[pose + oldest]
        for i in range(count):
            for axis in range(3):
                memory.finger_poses_m[pose * count + i, axis] = memory.finger_poses_m[(pose + oldest) * count + i, axis]
    state.finger_poses, memory.finger_poses_s[kept] = kept + 1, now
    passed, fastest = now - memory.finger_poses_s[0], 0.0
    for i in range(count):
        lever = subtract(load(centers, i), tool)
        for axis in range(3):
            column = rotation[0, axis], rotation[1, axis], rotation[2, axis]
            memory.finger_poses_m[kept * count + i, axis] = dot(lever, column)
        moved = subtract(load(memory.finger_poses_m, kept * count + i), load(memory.finger_poses_m, i))
        for axis in range(3):
            speed = dot(load(rotation, axis), scale(1.0 / passed, moved)) if passed > 0.0 else 0.0
            memory.own_m_s[i, axis], fastest = speed, max(fastest, abs(speed))
    state.moves_fingers = 1 if fastest > _NOISE_M_S else 0
    if state.moves_fingers == 0:
        memory.own_m_s[:count] = 0.0
