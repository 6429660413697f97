"""Present onset distances: the shortest of the recent looks, each less the tool's motion since the look.

If the tool has only translated since, the subtraction is exact.
"""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.reaction import HORIZON_S
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, dot, norm
from robot_side.field.scratch import STRENGTHS
from robot_side.laws.memory import ROOM, memory_at
from robot_side.laws.prospect import horizon_m
from robot_side.tick.sensed import (
    ACCELERATION,
    DISPLACEMENT,
    ENLARGEMENT,
    FULL_SPEED,
    HORIZON,
    L2,
    NUMBERS,
    NUMBERS_PER_SIDE,
    OVERLAP,
    R2,
    RUMBLE,
    SPEED,
    STICK,
    STIFFNESS,
    TOOL_SPEED,
)

MOST_M: Final = 100.0
"""Largest distance (m) or speed (m/s) in a message; larger ones are cut to it. An unstable simulation would exceed it,
and must still report."""


def felt_array() -> FloatArray:
    """Return an array for the numbers of `Sensed`, followed by the 16 onset distances in the stick's direction."""
    return np.zeros(NUMBERS + 2 * STRENGTHS)


@inlined
def _bounded(value: float, least: float, most: float) -> float:
    return min(max(value, least), most)


@inlined
def _moved(one: Any, tool: Vector) -> float:
    """Return the distance (m) that the tool has moved along a look's direction since the look."""
    return dot((one.direction[0], one.direction[1], one.direction[2]), tool) - float(one.began)


@building_block
def _shortest(seen: np.ndarray, side: int, count: int, tool: Vector, onsets: FloatArray) -> None:
    """Fill onsets (16,), fast then slow, with a side's shortest onset distances from the tool's present position."""
    onsets[: 2 * STRENGTHS] = math.inf
    for k in range(ROOM * side, ROOM * side + count):
        one = seen[k]
        moved = _moved(one, tool)
        for kind in range(2):
            for strength in range(STRENGTHS):
                place = STRENGTHS * kind + strength
                onsets[place] = min(onsets[place], one.onsets[kind, strength] - moved)


@inlined
def _reached(onsets: FloatArray, first: int, reach: float) -> int:
    """Count those of the eight onset distances from index `first` on that are at most `reach`."""
    count = 0
    for place in range(first, first + STRENGTHS):
        if onsets[place] <= reach:
            count += 1
    return count


@inlined
def _known(bundle: IntArray, side: int, tool: Vector) -> float:
    """Return the distance ahead of the tool that the newest look from place 0, the gripper's own, still covers."""
    memory = memory_at(bundle)
    known = -math.inf
    latest = -math.inf
    for k in range(ROOM * side, ROOM * side + memory.counts[side]):
        one = memory.seen[k]
        if one.place == 0 and one.at >= latest:
            latest = one.at
            known = memory.newest[side].reach - _moved(one, tool)
    return known


@building_block
def feel(
    bundle: IntArray,
    tool: Vector,
    approach: Vector,
    velocity: Vector,
    loop_age: float,
    is_known: bool,
    deflection: float,
    felt: FloatArray,
) -> None:
    """Fill `felt`, made by `felt_array`: both triggers' fields and the rumble. The tool is at `tool`, with `velocity`.

    loop_age: t_d in s. is_known: whether t_d is measured; if not, it is the configured worst case. deflection: the
    stick's, 0 to 1. Where the stick commands less than the touch speed, the rumble takes the slow onset distances.
    """
    memory = memory_at(bundle)
    seen, counts, newest, settings = memory.seen, memory.counts, memory.newest, memory.settings[0]
    speed, ahead = dot(velocity, approach), math.inf
    for side in (R2, L2):
        able = newest[side]
        ahead = min(ahead, horizon_m(able.speed, able.acceleration, loop_age))
        ahead = min(ahead, _known(bundle, side, tool))
    for side in (R2, L2):
        mine, able = felt[side * NUMBERS_PER_SIDE :], newest[side]
        _shortest(seen, side, counts[side], tool, mine)
        # Commands under way from an operator who has echoed nothing are unknown: full speed is the worst case.
        under_way = speed if side == R2 else -speed
        if not is_known:
            under_way = max(under_way, able.speed)
        displacement = _bounded(under_way * loop_age, -MOST_M, MOST_M)
        for place in range(2 * STRENGTHS):
            mine[place] = _bounded(mine[place], -MOST_M, min(ahead, MOST_M))
        mine[FULL_SPEED], mine[ACCELERATION] = able.speed, able.acceleration
        mine[DISPLACEMENT], mine[STIFFNESS] = displacement, _reached(mine, 0, displacement) / STRENGTHS
    felt[RUMBLE] = 0.0
    if counts[STICK] > 0:
        # D = u (t_d + h) + u²/2a (eq. 8).
        stick_speed = settings.stick_speed * min(deflection, 1.0)
        reach = stick_speed * (loop_age + HORIZON_S) + stick_speed * stick_speed / (2.0 * newest[STICK].acceleration)
        onsets = felt[NUMBERS:]
        _shortest(seen, STICK, counts[STICK], tool, onsets)
        felt[RUMBLE] = _reached(onsets, STRENGTHS if stick_speed < settings.touch_speed else 0, reach) / STRENGTHS
    leading, tool_speed = newest[R2 if speed >= 0.0 else L2], norm(velocity)
    felt[SPEED], felt[HORIZON] = _bounded(speed, -MOST_M, MOST_M), _bounded(ahead, 0.0, MOST_M)
    felt[ENLARGEMENT], felt[OVERLAP], felt[TOOL_SPEED] = (
        tool_speed * loop_age + leading.sigma,
        leading.overlap,
        tool_speed,
    )
