"""Store of the recent looks along each side from each place. `felt` takes the shortest of their onset distances."""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load
from robot_side.field.scratch import STRENGTHS
from robot_side.laws.memory import ROOM, SIDES, memory_at
from robot_side.laws.prospect import FIELD_PERIOD_S

STEADY_S: Final = 0.1
"""Time for which a look's onset distances count. The operator side also lets a trigger's strength fall over 0.1 s."""
_SAME_DIRECTION: Final = 0.999
"""Cosine of the largest angle, 2.6°, at which two looks count as along the same direction"""


@inlined
def look_from(bundle: IntArray, side: int, places: int) -> None:
    """Set the number of places from which looks along one side are made; forget looks from any further places."""
    memory = memory_at(bundle)
    first, kept = ROOM * side, 0
    for place in range(memory.places[side], places):
        memory.looked_s[side, place], memory.nearest_m[side, place] = -math.inf, math.inf
    if places < memory.places[side]:
        for k in range(first, first + memory.counts[side]):
            if memory.seen[k].place < places:
                memory.seen[first + kept] = memory.seen[k]
                kept += 1
        memory.counts[side] = kept
    memory.places[side] = places


@inlined
def longest_waiting(bundle: IntArray, now: float) -> tuple[float, int, int]:
    """Return the longest time since a look, in periods, with the look's side and place.

    Places ahead on the path have three times the period of place 0.
    """
    memory = memory_at(bundle)
    most, of_side, of_place = -math.inf, 0, 0
    for side in range(SIDES):
        for place in range(memory.places[side]):
            period = 3.0 * FIELD_PERIOD_S if place > 0 else FIELD_PERIOD_S
            waited = (now - memory.looked_s[side, place]) / period
            if waited > most:
                most, of_side, of_place = waited, side, place
    return most, of_side, of_place


@inlined
def longest_ago(bundle: IntArray) -> float:
    """Return the time of the longest-waiting last look: the earliest of all sides and places."""
    memory = memory_at(bundle)
    first = math.inf
    for side in range(SIDES):
        for place in range(memory.places[side]):
            first = min(first, memory.looked_s[side, place])
    return first


@inlined
def keep(bundle: IntArray, side: int, place: int, now: float, tool: Vector, onsets: FloatArray) -> None:
    """Store a look that was made along the memory's prospect. onsets (2, 8): its onset distances, fast and slow list.

    tool: the tool's position. Earlier looks from the same place are forgotten if they are older than STEADY_S or along
    another direction. If the store is full, the oldest look is replaced.
    """
    memory = memory_at(bundle)
    along, first, kept = load(memory.direction.reshape(1, 3), 0), ROOM * side, 0
    seen, oldest = memory.seen, first
    for k in range(first, first + memory.counts[side]):
        one = seen[k]
        alike = dot((one.direction[0], one.direction[1], one.direction[2]), along) > _SAME_DIRECTION
        if one.place != place or (alike and now - one.at < STEADY_S):
            seen[first + kept] = one
            if one.at < seen[oldest].at:
                oldest = first + kept
            kept += 1
    row = oldest if kept == ROOM else first + kept
    memory.counts[side], memory.looked_s[side, place] = min(kept + 1, ROOM), now
    new, prospect = seen[row], memory.prospect[0]
    new.place, new.at, new.began = place, now, dot(along, tool)
    for axis in range(3):
        new.direction[axis] = along[axis]
    for kind in range(2):
        for strength in range(STRENGTHS):
            new.onsets[kind, strength] = prospect.gone + prospect.stretch * onsets[kind, strength]
    memory.nearest_m[side, place] = new.onsets[0, STRENGTHS - 1]
