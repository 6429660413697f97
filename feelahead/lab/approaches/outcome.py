"""The course of an approach, the outcome, and the criteria of both."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from common.arrays import FloatArray, IntArray

SAMPLE_S = 0.01
"""The period at which speed, gap and zones are noted."""
STANDS_M_S = 0.001
"""A gripper slower than this throughout the last second has stopped."""
SWING_M_S = 0.015
"""The least change of speed that counts as a reversal."""
_LAST_S = 1.0

End = Literal["contact", "stopped", "undecided", "disarmed", "failed"]
"""disarmed: the robot side stopped the arm, whatever was felt. failed: never armed, or touching from the start."""


@dataclass(frozen=True)
class Trace:
    """The course from the beginning of the pull on, a row each 10 ms."""

    time_s: FloatArray
    """(k,) since the pull began"""
    speed_m_s: FloatArray
    """(k,) of the true tool along its approach axis"""
    gap_m: FloatArray
    """(k,) true, to the nearest object"""
    travel: FloatArray
    """(k,) mechanical, of R2, 0 to 1"""
    strengths: IntArray
    """(k, 10) of R2's zones, 0 to 8"""


@dataclass(frozen=True)
class Outcome:
    """The end of an approach."""

    end: End
    contact_speed_mm_s: float | None
    """Closing speed along the true contact's normal at its onset; None without a contact."""
    contact_with: str | None
    least_gap_mm: float
    """The least true gap to any object, over the whole pull."""
    stops_at_mm: float | None
    """The true gap at the end, where the gripper was slower than 1 mm/s for the last second; else None."""
    way_left_mm: float | None
    """The way that is left along the approach axis, from there."""
    reversals: int
    """Number of turns of the speed from rising to falling or back, by more than 15 mm/s."""
    ended_s: float
    """Since the pull began."""
    trace: Trace = field(repr=False)
    why: str | None = None
    """The reason of an end that says nothing about the law."""


class Samples:
    """A trace in the making: time, speed, gap, travel and strengths, row by row."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, float, float, float, tuple[int, ...]]] = []

    def trace(self) -> Trace:
        """Return the rows so far as arrays."""
        times, speeds, gaps, travels = np.array([row[:4] for row in self.rows]).reshape(-1, 4).T.copy()
        strengths = np.array([row[4] for row in self.rows], dtype=np.int64).reshape(-1, 10)
        return Trace(times, speeds, gaps, travels, strengths)


def stands(trace: Trace) -> bool:
    """Tell whether the gripper was slower than 1 mm/s throughout the last second."""
    last = trace.time_s > trace.time_s[-1] - _LAST_S
    whole = trace.time_s[-1] - trace.time_s[0] >= _LAST_S - 2.0 * SAMPLE_S
    return bool(whole and (np.abs(trace.speed_m_s[last]) < STANDS_M_S).all())


def reversals(speeds_m_s: Sequence[float], swing_m_s: float = SWING_M_S) -> int:
    """Count how often the speed turned from rising to falling or back, by more than `swing_m_s`.

    It rises at first: an approach that goes on has none, one that slows down once has 1, a limit cycle has many.
    """
    count, sign, extreme = 0, 1.0, -math.inf
    for speed in speeds_m_s:
        if sign * speed >= sign * extreme:
            extreme = speed
        elif sign * (extreme - speed) > swing_m_s:
            count, sign, extreme = count + 1, -sign, speed
    return count
