"""Path of the gripper until the arm stands: a screw motion by trigger, sticks and fingers, and samples along it.

Sticks move and turn the tool in its own frame. Its point moves with v, and it turns with ω. After t it has turned by
θ = |ω| t, and its point has gone

    t V v,    V = 1 + (1 - cos θ)/θ [a] + (1 - sin θ/θ) [a]²,    a = ω/|ω|

(exponential map of SE(3)). The trigger moves it along the approach axis z, and so along the chord V z by then. The
chord points along z turned by θ/2. Commands under way have moved the tool by then: distances at a place include that.
"""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import FLOAT64, INT64, compiled, inlined, input_array
from robot_side.compiled.vectors import Vector, add, cross, load, norm, scale, subtract, unit
from robot_side.laws.memory import EVEN_PLACES, memory_at
from robot_side.laws.sensed import L2

SPACING_M: Final = 0.015
"""Largest motion of a sphere between two places: less than an inflated fingertip's sphere is wide. A gripper that would
need more than EVEN_PLACES has them farther apart."""
_LEAST_M: Final = 0.003
"""Smaller motions are ignored."""


@inlined
def fastest_m_s(bundle: IntArray, centers: FloatArray, tool: Vector, ahead: Vector) -> float:
    """Return the largest |v + ω × r + own| of all spheres, there and farther on by `ahead`, in m/s; NaN for NaN."""
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
    """Choose the times of the places on the path, even, the last at `until`. There are none if the gripper stays.

    ahead: distance ahead (m) at which places shall be as close as at the gripper. It matters in turns.
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
    """Return the time until the gripper is at a place. The last two places lie half a step beside the nearest one."""
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
    """Return v + across · a × v + twice · a × (a × v), the form of both a rotation and V (Rodrigues)."""
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
    """Move the tool and its spheres to their places in `after` seconds, and find the chord that leads on from there.

    origin, rotation (3, 3), centers (m, 3): the present ones, kept exactly after 0 s. linear, turning: velocities of
    the tool without the trigger's part (m/s, rad/s). ahead: the trigger's part by then, along the approach axis (m).
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
    """Move to a place of one side, 0 for the gripper's. Return the distance (m) that the trigger has covered by then.

    speed: along the approach axis. Commands under way last for the loop age. A place represents the path from half a
    step before it.
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
    """Move as `go_to` does, called from Python. bundle: the memory's. tool (3,)."""
    return go_to(bundle, load(tool.reshape(1, 3), 0), rotation, centers, side, place, speed, loop_age)
