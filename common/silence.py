"""Longest times between messages, and the part of them that counts as loop age; both sides use these values."""

from typing import Final

KEEP_ALIVE_S: Final = 0.02
"""Longest time between two stiffness messages, in seconds; commands are more frequent. In between the receiver
extrapolates."""
LONGEST_HELD_S: Final = 0.016
"""Longest time between two commands, in seconds. So even if lost packets hold up five successive commands, less than
0.1 s passes between two arrivals, which is the robot side's limit. At 20 ms four such commands stopped the arm."""


def counted_s(silent_s: float, turn_s: float) -> float:
    """Return the part of a silence that adds to the loop age, in seconds. turn_s: period of the silent side's turns.

    In each turn a message is left out only if the receiver's extrapolation is still right, so that what the receiver
    knows is no older. Of a silence the first `turn_s` counts; the time from there to KEEP_ALIVE_S does not. All time
    beyond KEEP_ALIVE_S counts, so that the loop age of a silent link grows.
    """
    return silent_s - min(max(silent_s - turn_s, 0.0), KEEP_ALIVE_S - turn_s)
