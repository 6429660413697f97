"""Longest times between messages, and the part of them that counts as loop age; both sides use these values."""

from typing import Final

MOTION_PERIOD_S: Final = 1.0 / 250.0
"""Period in seconds at which the operator side checks whether a command must be sent."""
KEEP_ALIVE_S: Final = 0.02
"""Longest time between two stiffness messages, in seconds; commands are more frequent. In between the receiver
extrapolates."""
LONGEST_HELD_S: Final = 4.0 * MOTION_PERIOD_S
"""Longest time between two commands, in seconds. So even if lost packets hold up five successive commands, less than
0.1 s passes between two arrivals, which is the robot side's limit. At 20 ms four such commands stopped the arm."""


def counted_s(silent_s: float) -> float:
    """Return the part of a silence that adds to the loop age, in seconds.

    A message is left out only if the receiver's extrapolation is still right, so that what the receiver knows is no
    older. Of a silence the first MOTION_PERIOD_S counts; the time from there to KEEP_ALIVE_S does not. All time beyond
    KEEP_ALIVE_S counts, so that the loop age of a silent link grows.
    """
    return silent_s - min(max(silent_s - MOTION_PERIOD_S, 0.0), KEEP_ALIVE_S - MOTION_PERIOD_S)
