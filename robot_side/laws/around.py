"""Coarse map of onset distances around the gripper, for an operator side that traces its path.

The operator side knows its sticks one loop age before the robot side. It traces its path through the map
(`operator_side/feel/path_ahead.py`). A probe is a place that a fully deflected stick reaches (`Around`). Each probe
keeps only the onset distances of full strength, fast and slow.
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
from robot_side.laws.sensed import HORIZON, L2, NUMBERS_PER_SIDE, R2

FIRST_PROBE: Final = 1 + MOST_PLACES
"""Place number of the first probe"""
STILL_M_S: Final = 0.002
_STILL_RAD_S: Final = 0.01
"""Speeds up to which gripper and objects count as at rest"""
_RETREATS_M_S: Final = 0.01
"""Speed below which both triggers count as leading"""
_SELDOM: Final = 4.0
"""Periods between looks along the trigger that does not lead"""
_HOLDS_S: Final = 1.5
"""Age at which a probe's look expires while something moves. Where ticks are rare, probes come late."""
_SAME_TIME: Final = 0.05
"""Relative change of T up to which the probes' looks count"""


@inlined
def follow_motion(
    bundle: IntArray, velocity: Vector, turning: Vector, moves: bool, until: float, now: float, by_operator: bool
) -> None:
    """Record when the gripper last moved. Discard the probes' looks if T (s) has changed.

    by_operator: the operator side traces the map; otherwise no look counts.
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
    """Return whether the map holds: each probe's look counts, and is recent if anything has moved since."""
    memory = memory_at(bundle)
    state, known = memory.state[0], bool(memory.settings[0].around != 0.0)
    for probe in range(2 * PROBES):
        at = memory.around[probe].at
        if at == -math.inf or at < state.counts_since or (at <= state.moved and state.measured - at > _HOLDS_S):
            known = False
    return known


@inlined
def probe_waiting(bundle: IntArray, now: float, speed: float) -> tuple[float, int, int]:
    """Find the probe that has waited longest: periods waited, side and place, as in `longest_waiting`."""
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
    """Move to a probe, 0 for the gripper's place. Return the distance (m) covered by then, as `go_to` does."""
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
    """Keep a look from a probe, as `keep` does from a place."""
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
    """Return the highest speed of an object against `approach`, without objects that are passed over."""
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
    """Fill ways (LISTS, PROBES), onset distances in m from the tool (3,). Return False while one is unknown.

    rotation (3, 3), classes (k,), velocities (k, 3), or (0, 3) if unknown, and felt as `sense` filled it.
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
            # A look includes the objects' motion until the gripper stands, but not their motion since the look.
            gone += closing * (memory.state[0].measured - one.at)
            for kind in range(2):
                onsets[2 * side + kind, probe] = one.onsets[kind] - gone
        for kind in range(2):
            # Straight ahead the newest look knows more: new objects and the motion of the fingers.
            newest = felt[side * NUMBERS_PER_SIDE + kind * STRENGTHS + STRENGTHS - 1]
            if newest < felt[HORIZON]:
                onsets[2 * side + kind, 0] = min(onsets[2 * side + kind, 0], newest)
    return True
