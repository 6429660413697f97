"""Coarse map of onset distances around the gripper, for an operator side that traces the gripper's path.

The operator side knows the sticks' deflection one loop age before the robot side does. It traces the path through the
map (`operator_side/feel/path_ahead.py`). A probe is a pose of the gripper from which looks are made: the present pose,
or one that a fully deflected stick leads to (`Around`). Each probe keeps the onset distances of full strength only, of
the fast and the slow list.
"""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from common.protocol.around import ACROSS, PERIOD_S, PROBES, TURNED
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import BOOL, compiled, inlined, input_array, input_indices, output_array
from robot_side.compiled.vectors import Vector, add, dot, load, norm, scale
from robot_side.field.object_class import SKIPPED
from robot_side.field.scratch import STRENGTHS
from robot_side.laws.memory import MOST_PLACES, memory_at
from robot_side.laws.path import move
from robot_side.tick.sensed import HORIZON, L2, NUMBERS_PER_SIDE, R2

FIRST_PROBE: Final = 1 + MOST_PLACES
"""Number of the first probe, counted after the places on the path"""
STILL_M_S: Final = 0.002
_STILL_RAD_S: Final = 0.01
"""Speed and angular speed up to which the gripper counts as at rest; objects count so up to STILL_M_S"""
_RETREATS_M_S: Final = 0.01
"""Speed along the approach axis, forwards or backwards, below which both triggers count as the one that moves the
gripper"""
_SELDOM: Final = 4.0
"""Period of a probe's looks along the trigger against which the gripper moves, in periods of the other trigger's"""
_HOLDS_S: Final = 1.5
"""Age at which a probe's look expires while something moves. It is long because looks from probes come late if ticks
are rare."""
_SAME_TIME: Final = 0.05
"""Largest relative change of T, the time until the arm stands, after which the probes' looks still count"""


@inlined
def follow_motion(
    bundle: IntArray, velocity: Vector, turning: Vector, moves: bool, until: float, now: float, by_operator: bool
) -> None:
    """Record when anything last moved. Discard the probes' looks if T, the time until the arm stands, has changed.

    moves: the gripper's spheres have changed in number. until: T in s. by_operator: whether the operator side traces
    the map; if not, no probe's look counts.
    """
    memory = memory_at(bundle)
    state = memory.state[0]
    if not by_operator:
        state.counts_since = math.inf
    elif state.counts_since == math.inf or abs(until - state.until) > _SAME_TIME * state.until:
        state.counts_since, state.until, moves = now, until, True
    moves = moves or state.moved == math.inf or state.moves_fingers == 1
    if moves or norm(velocity) > STILL_M_S or norm(turning) > _STILL_RAD_S:
        state.moved = now


@inlined
def is_known(bundle: IntArray) -> bool:
    """Return whether the map is valid: all probes have looks that count, each recent or made since the last motion."""
    memory = memory_at(bundle)
    state, known = memory.state[0], bool(memory.settings[0].around != 0.0)
    for probe in range(2 * PROBES):
        at = memory.around[probe].at
        if at == -math.inf or at < state.counts_since or (at <= state.moved and state.measured - at > _HOLDS_S):
            known = False
    return known


@inlined
def probe_waiting(bundle: IntArray, now: float, speed: float) -> tuple[float, int, int]:
    """Return the longest wait of a probe in periods, and its side and place, as `longest_waiting` does for places."""
    memory = memory_at(bundle)
    most, of_side, of_place = -math.inf, 0, 0
    state = memory.state[0]
    if memory.settings[0].around == 0.0 or state.counts_since == math.inf:
        return most, of_side, of_place
    for side in (R2, L2):
        leads = speed > -_RETREATS_M_S if side == R2 else speed < _RETREATS_M_S
        for probe in range(PROBES):
            at = memory.around[side * PROBES + probe].at
            # A discarded look is due again at once: until then the operator side has the old map.
            waited = (now - at) / (PERIOD_S if leads else _SELDOM * PERIOD_S) + (
                2.0 if at < state.counts_since else 0.0
            )
            waited = waited if at <= state.moved or at < state.counts_since else -math.inf
            if waited > most:
                most, of_side, of_place = waited, side, FIRST_PROBE + probe
    return most, of_side, of_place


@inlined
def go_to_probe(
    bundle: IntArray,
    tool: Vector,
    rotation: FloatArray,
    centers: FloatArray,
    side: int,
    probe: int,
    speed: float,
    loop_age: float,
) -> float:
    """Move the memory's gripper to a probe; probe 0 is its present pose.

    Return the distance (m) that the trigger has moved it by then, as `go_to` does.
    """
    memory = memory_at(bundle)
    settings, until = memory.settings[0], float(memory.state[0].until)
    linear, turning, after, since = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0
    if probe > 0:
        quarter, part = (probe - 1) // (ACROSS + TURNED), (probe - 1) % (ACROSS + TURNED) + 1
        right, up = (1.0 - quarter, 0.0) if quarter % 2 == 0 else (0.0, 2.0 - quarter)
        x, y = (rotation[0, 0], rotation[1, 0], rotation[2, 0]), (rotation[0, 1], rotation[1, 1], rotation[2, 1])
        if part <= ACROSS:
            linear = scale(settings.stick_speed, add(scale(right, x), scale(-up, y)))
            after, since = until * part / ACROSS, until * (part - 0.5) / ACROSS
        else:
            turning = scale(settings.turn_speed, add(scale(up, x), scale(right, y)))
            after, since = until * (part - ACROSS) / TURNED, until * (part - ACROSS - 0.5) / TURNED
    forth = 1.0 if side == R2 else -1.0
    gone: float = max(forth * speed, 0.0) * min(since, loop_age)
    move(bundle, tool, rotation, centers, linear, turning, after, forth * gone)
    return gone


@inlined
def keep_probe(bundle: IntArray, side: int, probe: int, now: float, tool: Vector, onsets: FloatArray) -> None:
    """Store a probe's newest look; `keep` does the same for places on the path. onsets (2, 8): fast and slow list."""
    memory = memory_at(bundle)
    along, prospect = load(memory.direction.reshape(1, 3), 0), memory.prospect[0]
    new = memory.around[side * PROBES + probe]
    new.at, new.began = now, dot(along, tool)
    for axis in range(3):
        new.direction[axis] = along[axis]
    for kind in range(2):
        new.onsets[kind] = prospect.gone + prospect.stretch * onsets[kind, STRENGTHS - 1]


@inlined
def _closing(approach: Vector, classes: IntArray, velocities: FloatArray) -> float:
    """Return the highest speed (m/s) at which an object comes against `approach`, 0 if none does.

    Objects of the class SKIPPED do not count.
    """
    closing = 0.0
    for thing in range(velocities.shape[0]):
        if classes[thing] != SKIPPED:
            closing = max(closing, -dot(approach, load(velocities, thing)))
    return closing


@compiled(
    *(BUNDLE, input_array(1), input_array(2), input_indices(), input_array(2), input_array(1), output_array(2)),
    returns=BOOL,
)
def ways_around(
    bundle: IntArray,
    tool: FloatArray,
    rotation: FloatArray,
    classes: IntArray,
    velocities: FloatArray,
    felt: FloatArray,
    onsets: FloatArray,
) -> bool:
    """Fill the map `onsets` (LISTS, PROBES) with onset distances in m from the tool. Return False if it is not valid.

    tool (3,), rotation (3, 3): the tool's present pose. classes (k,). velocities: (k, 3), or (0, 3) if unknown.
    felt: as `sense` filled it.
    """
    memory, place = memory_at(bundle), load(tool.reshape(1, 3), 0)
    if velocities.shape[0] > classes.size or not is_known(bundle):
        return False
    for side in (R2, L2):
        approach = scale(1.0 if side == R2 else -1.0, (rotation[0, 2], rotation[1, 2], rotation[2, 2]))
        closing = _closing(approach, classes, velocities)
        for probe in range(PROBES):
            one = memory.around[side * PROBES + probe]
            gone = dot((one.direction[0], one.direction[1], one.direction[2]), place) - one.began
            # A look includes the objects' motion until the gripper stops, but not their motion since the look.
            gone += closing * (memory.state[0].measured - one.at)
            for kind in range(2):
                onsets[2 * side + kind, probe] = one.onsets[kind] - gone
        for kind in range(2):
            # Straight ahead the present field knows more: new objects and the motion of the fingers.
            newest = felt[side * NUMBERS_PER_SIDE + kind * STRENGTHS + STRENGTHS - 1]
            if newest < felt[HORIZON]:
                onsets[2 * side + kind, 0] = min(onsets[2 * side + kind, 0], newest)
    return True
