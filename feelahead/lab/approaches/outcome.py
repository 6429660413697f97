"""How an approach went and ended, and how that is judged."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from common.arrays import FloatArray, IntArray

SAMPLE_S = 0.01
"""Speed, gap and zones are noted this often."""
STANDS_M_S = 0.001
"""Slower than this for the last second, the gripper has stopped."""
SWING_M_S = 0.015
"""A change of speed that counts when reversals are counted."""
_LAST_S = 1.0

End = Literal["contact", "stopped", "undecided", "disarmed", "failed"]
"""disarmed: the robot side stopped the arm, whatever was felt. failed: never armed, or touching from the start."""


@dataclass(frozen=True)
class Trace:
    """What happened from the beginning of the pull on, a row each 10 ms."""

    time_s: FloatArray
    """(k,) since the pull began"""
    speed_m_s: FloatArray
    """(k,) of the true tool along its approach axis"""
    gap_m: FloatArray
    """(k,) true, to whatever is nearest"""
    travel: FloatArray
    """(k,) mechanical, of R2, 0 to 1"""
    strengths: IntArray
    """(k, 10) of R2's zones, 0 to 8"""


@dataclass(frozen=True)
class Outcome:
    """How an approach ended."""

    end: End
    contact_speed_mm_s: float | None
    """Closing speed along the true contact's normal at its onset; None without a contact."""
    contact_with: str | None
    least_gap_mm: float
    """True, to whatever is nearest, over the whole pull."""
    stops_at_mm: float | None
    """The true gap at the end, where the gripper was slower than 1 mm/s for the last second; else None."""
    way_left_mm: float | None
    """How far it could still go along its approach axis, from there."""
    reversals: int
    """How often the speed turned from rising to falling or back, by more than 15 mm/s."""
    ended_s: float
    """Since the pull began."""
    trace: Trace = field(repr=False)
    why: str | None = None
    """Of an end that says nothing about the law."""


@dataclass
class Samples:
    """A trace in the making."""

    time_s: list[float] = field(default_factory=list)
    speed_m_s: list[float] = field(default_factory=list)
    gap_m: list[float] = field(default_factory=list)
    travel: list[float] = field(default_factory=list)
    strengths: list[tuple[int, ...]] = field(default_factory=list)

    def trace(self) -> Trace:
        """All of it so far."""
        return Trace(
            np.array(self.time_s),
            np.array(self.speed_m_s),
            np.array(self.gap_m),
            np.array(self.travel),
            np.array(self.strengths, dtype=np.int64).reshape(-1, 10),
        )


def stands(trace: Trace) -> bool:
    """Whether the gripper was slower than 1 mm/s throughout the last second."""
    last = trace.time_s > trace.time_s[-1] - _LAST_S
    whole = trace.time_s[-1] - trace.time_s[0] >= _LAST_S - 2.0 * SAMPLE_S
    return bool(whole and (np.abs(trace.speed_m_s[last]) < STANDS_M_S).all())


def reversals(speeds_m_s: Sequence[float], swing_m_s: float = SWING_M_S) -> int:
    """How often the speed turned from rising to falling or from falling to rising, by more than `swing_m_s`.

    It rises at first: an approach that goes on has none, one that slows down once has 1, a limit cycle has many.
    """
    count, sign, extreme = 0, 1.0, -math.inf
    for speed in speeds_m_s:
        if sign * speed >= sign * extreme:
            extreme = speed
        elif sign * (extreme - speed) > swing_m_s:
            count, sign, extreme = count + 1, -sign, speed
    return count
