"""Tracking of each joint: how far its motion stays behind what it was commanded, or goes beyond it.

Arms follow late, and not all alike. So what to expect is an interval: of the velocities commanded within `LAG_S` and
twice the states' lateness, which narrows no faster than the joints' limits of acceleration allow. The way that a joint
misses, or makes beyond this interval and an allowance, is added up (a cumulative sum; Page, 1954). The allowance is a
share of the way, so that the sum is forgotten by motion, and hardly by time. A joint that was behind may catch up.
"""

import math
from enum import IntEnum
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import FLOAT64, INT64, building_block, compiled, inlined, input_array, record_array

LAG_S: Final = 0.12
"""Longest lag of an arm behind its commands, in s, without the lateness of its states"""
_SLOT_S: Final = 0.02
_SLOTS: Final = 20
_LOST_S: Final = 0.1
"""Time between two states, in s, after which tracking begins anew"""
_ALLOWED: Final = 0.2
"""Share of the expected way that a joint may miss or make beyond"""
_CREEP_S: Final = 4.0
"""Time in which a joint may creep by the way that is noticed; time constant, in s, of what is forgotten without motion
"""
_SPEED_S: Final = 0.1
_RECENT_S: Final = 0.2
_LOAD_S: Final = 0.03
_USUAL_LOAD_S: Final = 1.0
"""Time constants, in s, of the measured velocity, a joint's recent share, its load and usual load"""
_STILL: Final = 0.25
_NO_LONGER_STILL: Final = 0.35
_FOLLOWS: Final = 0.85
"""Shares of its recent command: below the first a joint counts as still, up to the second it remains so, and from the
last it follows again"""
_JUDGED: Final = 0.25
"""Least recent command by which a joint is judged; a share of the way that is noticed, as the next"""
_NEAR_END: Final = 5.0
"""Distance from the end of its range, beyond what it needs to stop, within which a joint may stand"""
_LEAST_LOAD_NM: Final = 0.1
_NOISES: Final = 4.0
_PRESSES_S: Final = 0.03
_EXCUSED_S: Final = 0.3
"""Rise of a joint's load, beyond so many times its noise and for so long, that shows that something holds or pushes the
joint; time for which this explains a fault"""


class Fault(IntEnum):
    """Way in which a joint does not follow."""

    NONE = 0
    SLOW = 1
    FAR = 2
    """Motion that is faster than commanded, or goes on after the command."""
    STILL = 3
    ASTRAY = 4
    """Motion in the other direction, or without a command."""


TRACK: Final = np.dtype(
    [
        ("fault", np.int64),
        *(
            (name, np.float64)
            for name in (
                *("position", "least", "greatest", "next_least", "next_greatest", "toward", "short", "up", "down"),
                *("speed", "told", "made", "lasts", "held", "error", "limit", "turn"),
                *("load", "usual_load", "noise", "known", "pressed"),
            )
        ),
        ("least_told", np.float64, (_SLOTS,)),
        ("greatest_told", np.float64, (_SLOTS,)),
    ]
)
"""Record of a joint, in rad and s. held: time for which its load still explains its fault; 0 if it does not. least,
greatest: expected velocity; next_least, next_greatest: what these approach. toward: last direction of that velocity.
limit: way that is noticed. turn: after which readings may repeat; 0 if they do not. short: way that the joint stays
behind. up, down: ways beyond. told, made: recent commanded and measured ways along `toward`. lasts: time for which a
fault other than SLOW lasts. error: measured velocity beyond the expected ones, while at fault. noise: mean deviation of
a load's readings. known: share of the usual load that is known. pressed: time for which the drive has pressed against a
deviation. least_told, greatest_told: bounds of the commands in each time slot."""
CLOCK: Final = np.dtype([("slot", np.int64), ("faults", np.int64), ("time", np.float64)])
"""Record of the tracking: number of the newest time slot, number of joints at fault, time of the newest state"""


@inlined
def _approached(value: float, since: float, constant: float) -> float:
    """Return the share by which a quantity with the time constant approaches another during `since`."""
    return value * -math.expm1(-since / constant)


@building_block
def _begin(tracks: Any, command: FloatArray, positions: FloatArray, loads: FloatArray) -> None:
    for j in range(tracks.size):
        one = tracks[j]
        one.position, one.toward, one.speed, one.error = positions[j], 0.0, 0.0, 0.0
        one.least, one.greatest = min(command[j], 0.0), max(command[j], 0.0)
        one.short, one.up, one.down, one.told, one.made, one.lasts = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        one.load = loads[j] if loads.size > 0 else 0.0
        one.usual_load, one.noise, one.known, one.pressed = one.load, 0.0, 0.0, 0.0
        one.fault, one.held = 0, 0.0
        for slot in range(_SLOTS):
            one.least_told[slot], one.greatest_told[slot] = one.least, one.greatest


@building_block
def _expect(
    tracks: Any, clock: Any, lower: FloatArray, upper: FloatArray, fastest: FloatArray, since: float, late: float
) -> None:
    """Update the expected velocities. lower, upper (n,): ends of the ranges. fastest (n,): limits of acceleration."""
    window, needed = min(int((LAG_S + 2.0 * late) / _SLOT_S) + 2, _SLOTS), 0.0
    for j in range(tracks.size):
        one = tracks[j]
        least, greatest = math.inf, -math.inf
        for k in range(window):
            slot = (clock.slot - k) % _SLOTS
            least, greatest = min(least, one.least_told[slot]), max(greatest, one.greatest_told[slot])
        near = _NEAR_END * one.limit + max(least * least, greatest * greatest) / (2.0 * fastest[j])
        if one.position < lower[j] + near:
            greatest = max(greatest, 0.0)
        if one.position > upper[j] - near:
            least = min(least, 0.0)
        one.next_least, one.next_greatest = least, greatest
        needed = max(needed, (least - one.least) / fastest[j], (one.greatest - greatest) / fastest[j])
    share = since / needed if needed > since else 1.0
    for j in range(tracks.size):
        one = tracks[j]
        one.least += min(share * (one.next_least - one.least), one.next_least - one.least)
        one.greatest += max(share * (one.next_greatest - one.greatest), one.next_greatest - one.greatest)


@building_block
def _add_up(one: Any, moved: float, since: float) -> None:
    """Add a joint's motion to its ways, behind and beyond what is expected."""
    toward = 1.0 if one.least > 0.0 else -1.0 if one.greatest < 0.0 else 0.0
    expected = max(one.least, -one.greatest, 0.0)
    if toward == 0.0 or toward != one.toward:
        one.told = one.made = 0.0
        if toward != 0.0:
            one.toward, one.short = toward, 0.0
    forgotten, creep = math.exp(-since / _CREEP_S), one.limit / _CREEP_S
    kept = one.short if expected > 0.0 else forgotten * one.short
    one.short = max(kept + (1.0 - _ALLOWED) * expected * since - one.toward * moved, 0.0)
    most, least = max(one.greatest, 0.0), max(-one.least, 0.0)
    up = moved - (most + max(_ALLOWED * most, creep)) * since
    down = -moved - (least + max(_ALLOWED * least, creep)) * since
    if one.short > 0.0:  # what was behind may catch up
        up, down = (min(up, 0.0), down) if one.toward > 0.0 else (up, min(down, 0.0))
    one.up, one.down = max(forgotten * one.up + up, 0.0), max(forgotten * one.down + down, 0.0)
    recent = math.exp(-since * min(1.0 / _RECENT_S, expected / one.limit))
    one.told = recent * one.told + expected * since
    one.made = recent * one.made + toward * moved
    one.speed += _approached(moved / since - one.speed, since, _SPEED_S)


@building_block
def _judge(one: Any, load: float, since: float) -> None:
    """Update a joint's fault."""
    limit, before, fault = one.limit, one.fault, Fault.NONE
    side = 1.0 if one.up > one.down else -1.0
    off = side * (one.speed - (one.greatest if side > 0.0 else one.least))
    astray = before in (Fault.FAR, Fault.ASTRAY)
    if (astray or max(one.up, one.down) > limit) and off > max(_ALLOWED * abs(one.speed), 2.0 * limit / _CREEP_S):
        fault = Fault.FAR if side == one.toward else Fault.ASTRAY
    elif astray:
        one.up = one.down = 0.0
    elif one.told > _JUDGED * limit and one.made < _FOLLOWS * one.told and (before > 0 or one.short > limit):
        still = _NO_LONGER_STILL if before == Fault.STILL else _STILL
        fault = Fault.STILL if one.made < still * one.told else Fault.SLOW
    one.fault = fault
    if max(one.up, one.down, one.short) < 0.25 * limit:
        one.known += _approached(1.0 - one.known, since, _USUAL_LOAD_S)
        share = _approached(1.0, since, _USUAL_LOAD_S) / one.known
        one.noise += share * (abs(load - one.load) - one.noise)
        one.usual_load += share * (load - one.usual_load)
    one.load += _approached(load - one.load, since, _LOAD_S)
    # A drive that is held up or pushed presses against its deviation. A load that only ceases presses on nothing.
    against = one.toward if one.short > max(one.up, one.down) else -side
    least = max(against * one.usual_load, 0.0) + _LEAST_LOAD_NM + _NOISES * one.noise
    one.pressed = one.pressed + since if against * one.load > least else 0.0
    one.held = max(one.held - since, 0.0) if fault > 0 else 0.0
    if fault > 0 and one.pressed >= _PRESSES_S:
        one.held = _EXCUSED_S
    stopping = fault in (Fault.FAR, Fault.ASTRAY, Fault.STILL)
    one.lasts = one.lasts + since if stopping and fault == before else 0.0
    one.error = one.speed - min(max(one.speed, one.least), one.greatest) if fault > 0 else 0.0


@compiled(
    *(record_array(TRACK), record_array(CLOCK), input_array(1), input_array(1), input_array(1)),
    *(input_array(1), input_array(1), input_array(1), FLOAT64, FLOAT64),
    returns=INT64,
)
def track(
    tracks: np.ndarray,
    clocks: np.ndarray,
    command: FloatArray,
    positions: FloatArray,
    loads: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    fastest: FloatArray,
    time: float,
    late: float,
) -> int:
    """Take a tick's command (n,) and the newest state; return the number of joints at fault.

    loads: (n,), or none. lower, upper, fastest: as in `_expect`. time, late: the state's time and lateness. Each
    track has its limit.
    """
    clock, newest = clocks[0], math.floor(time / _SLOT_S)
    since = time - clock.time
    if not 0.0 <= since < _LOST_S:
        clock.slot, clock.time, clock.faults = newest, time, 0
        _begin(tracks, command, positions, loads)
        return 0
    for j in range(tracks.size):
        one, slot = tracks[j], clock.slot % _SLOTS
        one.least_told[slot] = min(one.least_told[slot], command[j])
        one.greatest_told[slot] = max(one.greatest_told[slot], command[j])
        for after in range(clock.slot + 1, newest + 1):
            # A slot that no tick fell into had the commands of the one before.
            lasts = after < newest
            one.least_told[after % _SLOTS] = one.least_told[slot] if lasts else command[j]
            one.greatest_told[after % _SLOTS] = one.greatest_told[slot] if lasts else command[j]
    if since == 0.0:
        return int(clock.faults)
    clock.slot, clock.time, clock.faults = max(newest, clock.slot), time, 0
    _expect(tracks, clock, lower, upper, fastest, since, late)
    for j in range(tracks.size):
        one, moved = tracks[j], positions[j] - tracks[j].position
        if one.turn > 0.0:
            moved -= one.turn * np.rint(moved / one.turn)
        one.position = positions[j]
        _add_up(one, moved, since)
        _judge(one, loads[j] if loads.size > 0 else 0.0, since)
        clock.faults += 1 if one.fault > 0 else 0
    return int(clock.faults)
