"""Checks of ranges by hand, for messages made hundreds of times a second: `check_limits` takes four times as long."""

import math
from collections.abc import Iterable
from typing import Final

FARTHEST_M: Final = 100.0
LATEST_S: Final = 1.02
"""Longest time in which an arm responds, in s"""
"""Largest distance in a message"""


def in_range(name: str, low: float, high: float, value: float) -> None:
    """Raise ValueError unless `value` is within the limits."""
    if not low <= value <= high:  # false for NaN, too
        raise ValueError(f"{name} = {value}; valid: {low} to {high}")


def all_in_range(name: str, low: float, high: float, values: Iterable[float]) -> None:
    """Raise ValueError unless all values are within the limits."""
    for value in values:
        in_range(name, low, high, value)


def finite(name: str, value: float) -> None:
    """Raise ValueError for NaN and infinity."""
    if not math.isfinite(value):
        raise ValueError(f"{name} = {value}; valid: a finite number")


def rising(name: str, onsets: tuple[float, ...]) -> None:
    """Raise ValueError unless eight onset distances ascend."""
    a, b, c, d, e, f, g, h = onsets
    if -FARTHEST_M <= a <= b <= c <= d <= e <= f <= g <= h <= FARTHEST_M:  # fast path: two in each tick
        return
    all_in_range(name, -FARTHEST_M, FARTHEST_M, onsets)
    raise ValueError(f"{name} = {onsets}; valid: eight distances, each at least as long as the one before")


def both_or_neither(name: str, sent_s: float | None, held_s: float | None) -> None:
    """Raise ValueError unless both stamps of an echo are valid, or both are None."""
    if sent_s is None or held_s is None:
        if sent_s is not held_s:
            raise ValueError(f"only one of {name}_sent_s and {name}_held_s is given; valid: both or neither")
        return
    finite(f"{name}_sent_s", sent_s)
    in_range(f"{name}_held_s", 0.0, 1e9, held_s)
