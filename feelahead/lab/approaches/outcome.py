"""Course of an approach over time, its outcome, and the criteria for it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from common.arrays import FloatArray, IntArray

SAMPLE_S = 0.01
"""Sampling period of speed, gap and zones, in seconds."""
STANDS_M_S = 0.001
"""Speed in m/s; a gripper that was slower for the last second has stopped."""
SWING_M_S = 0.015
"""Minimum change of speed, in m/s, that counts as a reversal."""
_LAST_S = 1.0

End = Literal["contact", "stopped", "undecided", "disarmed", "failed"]
"""How an approach ended. disarmed: the robot side stopped the arm, whatever was felt. failed: the arm was never armed,
or touched something from the start."""


@dataclass(frozen=True)
class Trace:
    """Course of an approach from the beginning of the pull, with a row every 10 ms."""

    time_s: FloatArray
    """(k,) time since the pull began"""
    speed_m_s: FloatArray
    """(k,) speed of the true tool along its approach axis"""
    gap_m: FloatArray
    """(k,) true gap to the nearest object"""
    travel: FloatArray
    """(k,) mechanical travel of R2, 0 to 1"""
    strengths: IntArray
    """(k, 10) strengths of R2's zones, 0 to 8"""


@dataclass(frozen=True)
class Outcome:
    """How an approach ended, and its figures."""

    end: End
    contact_speed_mm_s: float | None
    """Closing speed along the true contact's normal at its onset; None without a contact."""
    contact_with: str | None
    least_gap_mm: float
    """Least true gap to any object over the whole pull."""
    stops_at_mm: float | None
    """True gap at the end if the gripper was slower than 1 mm/s for the last second; else None."""
    way_left_mm: float | None
    """Distance that the gripper could still go along its approach axis before a contact, at that time."""
    reversals: int
    """How often the speed turned from rising to falling, or back, by more than 15 mm/s."""
    ended_s: float
    """Time of the end, since the pull began."""
    trace: Trace = field(repr=False)
    why: str | None = None
    """Reason for an end that says nothing about the law; None for other ends."""
    later_ms: float = 0.0
    """Time by which stops were later than the arm's limits said, as the robot side noticed"""


def stands(trace: Trace) -> bool:
    """Return whether the gripper was slower than 1 mm/s throughout the last second."""
    last = trace.time_s > trace.time_s[-1] - _LAST_S
    whole = trace.time_s[-1] - trace.time_s[0] >= _LAST_S - 2.0 * SAMPLE_S
    return bool(whole and (np.abs(trace.speed_m_s[last]) < STANDS_M_S).all())


def reversals(speeds_m_s: Sequence[float], swing_m_s: float = SWING_M_S) -> int:
    """Count how often the speed turns from rising to falling, or back, by more than `swing_m_s`.

    The speed rises first. So an approach that goes on has 0 reversals, one that slows down once has 1, and a limit
    cycle has many.
    """
    count, sign, extreme = 0, 1.0, -math.inf
    for speed in speeds_m_s:
        if sign * speed >= sign * extreme:
            extreme = speed
        elif sign * (extreme - speed) > swing_m_s:
            count, sign, extreme = count + 1, -sign, speed
    return count
