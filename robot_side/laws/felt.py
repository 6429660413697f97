"""What is felt now of what was seen lately: the ways are shortened by what the tool has moved along since.

The shortest ways hold. For a translation that is exact.
"""

import math
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.reaction import HORIZON_S
from robot_side.compiled.kernel import (
    NUMBER,
    TRUTH,
    building_block,
    compiled,
    inlined,
    input_array,
    input_indices,
    output_array,
    record_array,
)
from robot_side.compiled.vectors import Vector, dot, load, norm
from robot_side.field.scratch import STRENGTHS
from robot_side.laws.recent_looks import L2, NEWEST, R2, ROOM, SEEN, STICK

BEYOND_M: Final = 0.05
"""So much farther than what a reaction, the loop age and braking take is looked, as the loop age varies."""
MOST_M: Final = 100.0
"""What a message can say; a simulation about to become unstable shows wild figures, and must get to say so."""
DISPLACEMENT, STIFFNESS, FULL_SPEED, ACCELERATION, OF_A_SIDE = (2 * STRENGTHS + k for k in range(5))
"""Of one side's numbers, after eight fast and eight slow ways: δ in m, s(δ), v_max, a."""
SPEED, HORIZON, RUMBLE, ENLARGEMENT, OVERLAP, NUMBERS = (2 * OF_A_SIDE + k for k in range(6))
"""After those of R2 and L2: m/s along R2, m, 0 to 1, m, m³; and how many numbers there are in all."""


def room_to_feel() -> FloatArray:
    """Room for the numbers, and for the stick's ways after them."""
    return np.zeros(NUMBERS + 2 * STRENGTHS)


@inlined
def _bounded(value: float, least: float, most: float) -> float:
    """What is no number stays none: the message refuses it."""
    if value < least:
        return least
    return most if value > most else value


def horizon_m(speed_m_s: float, acceleration_m_s2: float, loop_age_s: float) -> float:
    """How far full speed gets before anything felt stops it, and a little more."""
    braking_m = speed_m_s * speed_m_s / (2.0 * acceleration_m_s2)
    return speed_m_s * (loop_age_s + HORIZON_S) + braking_m + BEYOND_M


_horizon = inlined(horizon_m)
"""The same in kernels."""


@inlined
def _moved(one: Any, tool: Vector) -> float:
    """How far the tool has got along a look's direction since."""
    return dot((one.direction[0], one.direction[1], one.direction[2]), tool) - float(one.began)


@building_block
def _shortest(seen: np.ndarray, side: int, count: int, tool: Vector, ways: FloatArray) -> None:
    """Fill ways (16,), fast and slow, from where the tool is now."""
    ways[: 2 * STRENGTHS] = math.inf
    for k in range(ROOM * side, ROOM * side + count):
        one = seen[k]
        moved = _moved(one, tool)
        for kind in range(2):
            for strength in range(STRENGTHS):
                place = STRENGTHS * kind + strength
                ways[place] = min(ways[place], one.ways[kind, strength] - moved)


@inlined
def _reached(ways: FloatArray, first: int, reach: float) -> int:
    """How many of the eight ways from `first` on are no longer than this."""
    count = 0
    for place in range(first, first + STRENGTHS):
        if ways[place] <= reach:
            count += 1
    return count


@inlined
def _known(seen: np.ndarray, newest: np.ndarray, side: int, count: int, tool: Vector) -> float:
    """How far ahead of the tool anything is known: as far as the newest look reached from where the gripper is."""
    known = -math.inf
    latest = -math.inf
    for k in range(ROOM * side, ROOM * side + count):
        if seen[k].place == 0 and seen[k].at >= latest:
            latest = seen[k].at
            known = newest[side].reach - _moved(seen[k], tool)
    return known


@compiled(
    *(record_array(SEEN), input_indices(), record_array(NEWEST), input_array(1), input_array(2), input_array(2)),
    *(input_array(1), NUMBER, TRUTH, NUMBER, NUMBER, output_array(1)),
)
def feel(
    seen: np.ndarray,
    counts: IntArray,
    newest: np.ndarray,
    tool_position: FloatArray,
    tool_rotation: FloatArray,
    jacobian: FloatArray,
    rates: FloatArray,
    loop_age: float,
    is_known: bool,
    stick_speed: float,
    touch_speed: float,
    felt: FloatArray,
) -> None:
    """Fill `felt`, that of `room_to_feel`, from the tables of `Looks` for a tool at (3,), turned by (3, 3), rates (n,).

    jacobian (6, n). loop_age: t_d, known or at worst. stick_speed: that the stick commands, of which it is felt by the
    slow ways below touch_speed. Both in m/s.
    """
    tool = load(tool_position.reshape(1, 3), 0)
    approach = tool_rotation[0, 2], tool_rotation[1, 2], tool_rotation[2, 2]
    velocity = 0.0, 0.0, 0.0
    for k in range(rates.size):
        velocity = (
            velocity[0] + jacobian[0, k] * rates[k],
            velocity[1] + jacobian[1, k] * rates[k],
            velocity[2] + jacobian[2, k] * rates[k],
        )
    speed = dot(velocity, approach)
    # A minimum may hide what is no number.
    check = 0.0 if math.isfinite(tool[0] + tool[1] + tool[2]) else math.nan
    ahead = math.inf
    for side in (R2, L2):
        able = newest[side]
        ahead = min(ahead, _horizon(able.speed, able.acceleration, loop_age))
        ahead = min(ahead, _known(seen, newest, side, counts[side], tool))
    for side in (R2, L2):
        mine, able = felt[side * OF_A_SIDE :], newest[side]
        _shortest(seen, side, counts[side], tool, mine)
        # What is under way from an operator who has echoed nothing is not known: at worst full speed.
        under_way = speed if side == R2 else -speed
        if not is_known:
            under_way = max(under_way, able.speed)
        displacement = _bounded(under_way * loop_age, -MOST_M, MOST_M)
        for place in range(2 * STRENGTHS):
            mine[place] = check + _bounded(mine[place], -MOST_M, min(ahead, MOST_M))
        mine[FULL_SPEED], mine[ACCELERATION] = able.speed, able.acceleration
        mine[DISPLACEMENT], mine[STIFFNESS] = displacement, _reached(mine, 0, displacement) / STRENGTHS
    felt[RUMBLE] = 0.0
    if counts[STICK] > 0:
        # D = u (t_d + h) + u²/2a (eq. 8).
        reach = stick_speed * (loop_age + HORIZON_S) + stick_speed * stick_speed / (2.0 * newest[STICK].acceleration)
        ways = felt[NUMBERS:]
        _shortest(seen, STICK, counts[STICK], tool, ways)
        felt[RUMBLE] = _reached(ways, STRENGTHS if stick_speed < touch_speed else 0, reach) / STRENGTHS
    leading = newest[R2 if speed >= 0.0 else L2]
    felt[SPEED], felt[HORIZON] = _bounded(speed, -MOST_M, MOST_M), _bounded(ahead, 0.0, MOST_M)
    felt[ENLARGEMENT], felt[OVERLAP] = norm(velocity) * loop_age + leading.sigma, leading.overlap
