"""Predicted path of the gripper until the arm stands, and places on the path from which looks are made.

Sticks move and turn the tool in the tool's own frame, at the velocities v and ω, so the tool makes a screw motion.
After the time t the tool has turned by θ = |ω| t, and the sticks have displaced its point by

    t V v,    V = 1 + (1 - cos θ)/θ [a] + (1 - sin θ/θ) [a]²,    a = ω/|ω|

(exponential map of SE(3)). The trigger moves the tool along its approach axis z, which turns too. So the trigger
displaces it along the chord V z. Where the turn is across z, the chord points along z turned by θ/2. Fingers add their
own motion to their spheres. Onset distances from a place include the distance that commands under way will have moved
the tool by then.
"""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import FLOAT64, INT64, compiled, inlined, input_array
from robot_side.compiled.vectors import Vector, add, cross, load, norm, scale, subtract, unit
from robot_side.laws.memory import EVEN_PLACES, memory_at
from robot_side.tick.sensed import L2

SPACING_M: Final = 0.015
"""Largest motion of any sphere between two places: less than the width of an inflated fingertip's sphere. On a path
that would need more than EVEN_PLACES, places are farther apart."""
_LEAST_M: Final = 0.003
"""Largest motion of any sphere up to which the path has no places ahead"""


@inlined
def fastest_m_s(bundle: IntArray, centers: FloatArray, tool: Vector, ahead: Vector) -> float:
    """Return the largest speed |v + ω × r + own| of all spheres in m/s; NaN if any is not finite.

    Each sphere counts at its present position r from the tool, and as if it were displaced by `ahead`.
    """
    memory = memory_at(bundle)
    velocity, turning = load(memory.velocity, 0), load(memory.velocity, 1)
    fastest, check = 0.0, 0.0
    for i in range(centers.shape[0]):
        lever, alone = subtract(load(centers, i), tool), add(velocity, load(memory.own_m_s, i))
        near, far = norm(add(alone, cross(turning, lever))), norm(add(alone, cross(turning, add(lever, ahead))))
        fastest = max(fastest, near, far)
        # max() may hide NaN; the sum does not.
        check += near + far
    return fastest if math.isfinite(check) else math.nan


@inlined
def plan_places(
    bundle: IntArray, centers: FloatArray, tool: Vector, approach: Vector, until: float, ahead: float
) -> None:
    """Choose the times of the even places on the path; the last is `until`. A gripper at rest gets no such places.

    ahead: distance (m) along the approach axis at which the places must be as close together as at the gripper. In a
    turn, points farther ahead move faster.
    """
    memory = memory_at(bundle)
    state, farthest = memory.state[0], until * fastest_m_s(bundle, centers, tool, scale(ahead, approach))
    state.even_places = 0
    if farthest >= _LEAST_M and math.isfinite(farthest):
        state.even_places = min(math.ceil(farthest / SPACING_M), EVEN_PLACES)
    for number in range(state.even_places):
        memory.moments_s[number] = until * (number + 1) / state.even_places


@inlined
def time_of_place(bundle: IntArray, side: int, place: int) -> float:
    """Return the time in s until the gripper is at a place.

    The last two places lie half a step before and after the place with the shortest onset distance of full strength.
    """
    memory = memory_at(bundle)
    even = memory.state[0].even_places
    if place <= even:
        after: float = memory.moments_s[place - 1] if place > 0 else 0.0
        return after
    nearest = 0
    for one in range(1, even + 1):
        if memory.nearest_m[side, one] < memory.nearest_m[side, nearest]:
            nearest = one
    half_steps = 2.0 * nearest + (1.0 if place == even + 1 else -1.0)
    between: float = 0.5 * memory.moments_s[0] * min(max(half_steps, 1.0), 2.0 * even - 1.0)
    return between


@inlined
def _along_screw(vector: Vector, axis: Vector, across: float, twice: float) -> Vector:
    """Return v + across · a × v + twice · a × (a × v), with a = `axis`. Rotations (Rodrigues) and V have this form."""
    turned = cross(axis, vector)
    return add(vector, add(scale(across, turned), scale(twice, cross(axis, turned))))


@inlined
def move(
    bundle: IntArray,
    origin: Vector,
    rotation: FloatArray,
    centers: FloatArray,
    linear: Vector,
    turning: Vector,
    after: float,
    ahead: float,
) -> None:
    """Fill the memory with the pose of tool and spheres in `after` seconds, and with the chord of the trigger's path.

    origin, rotation (3, 3), centers (m, 3): the present pose; `after` = 0 copies it without rounding. linear, turning:
    velocities of the tool without the trigger's part (m/s, rad/s). ahead: distance (m) along the approach axis that
    the trigger moves the tool by then.
    """
    memory = memory_at(bundle)
    stays, axis, angle = after == 0.0, unit(turning), after * norm(turning)
    sine, versine = math.sin(angle), 2.0 * math.sin(0.5 * angle) ** 2
    across, twice = (versine / angle, 1.0 - sine / angle) if angle > 1e-9 else (0.5 * angle, 0.0)
    chord = _along_screw((rotation[0, 2], rotation[1, 2], rotation[2, 2]), axis, across, twice)
    moved = origin
    if not stays:
        sideways = _along_screw(scale(after, linear), axis, across, twice)
        moved = add(origin, add(sideways, scale(ahead, chord)))
    for k in range(3):
        memory.tool_m[k], memory.chord[k] = moved[k], chord[k]
        column = _along_screw((rotation[0, k], rotation[1, k], rotation[2, k]), axis, sine, versine)
        for row in range(3):
            memory.rotation[row, k] = column[row]
    for i in range(centers.shape[0]):
        center = load(centers, i)
        if not stays:
            lever = subtract(add(center, scale(after, load(memory.own_m_s, i))), origin)
            center = add(moved, _along_screw(lever, axis, sine, versine))
        for row in range(3):
            memory.centers_m[i, row] = center[row]


@inlined
def go_to(
    bundle: IntArray,
    tool: Vector,
    rotation: FloatArray,
    centers: FloatArray,
    side: int,
    place: int,
    speed: float,
    loop_age: float,
) -> float:
    """Fill the memory with the gripper's pose at a place of one side; place 0 is the present pose.

    Return the distance (m) that the trigger has moved the gripper by then: at `speed`, along the approach axis, for at
    most the loop age, as commands under way last no longer. It is taken half a step before the place, because a place
    represents the path from there on.
    """
    memory, after = memory_at(bundle), time_of_place(bundle, side, place)
    forth, since = 1.0 if side != L2 else -1.0, max(after - 0.5 * memory.moments_s[0], 0.0)
    gone: float = max(forth * speed, 0.0) * min(since, loop_age)
    velocity = load(memory.velocity, 0), load(memory.velocity, 1)
    move(bundle, tool, rotation, centers, *velocity, after, forth * gone)
    return gone


@compiled(BUNDLE, input_array(1), input_array(2), input_array(2), INT64, INT64, FLOAT64, FLOAT64, returns=FLOAT64)
def go_to_place(
    bundle: IntArray,
    tool: FloatArray,
    rotation: FloatArray,
    centers: FloatArray,
    side: int,
    place: int,
    speed: float,
    loop_age: float,
) -> float:
    """Do the same as `go_to`, as a kernel that Python can call. bundle: the memory's. tool (3,): position."""
    return go_to(bundle, load(tool.reshape(1, 3), 0), rotation, centers, side, place, speed, loop_age)
