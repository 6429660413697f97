"""Longest silences between messages, and their part in the loop age: the same for both sides."""

from typing import Final

MOTION_PERIOD_S: Final = 1.0 / 250.0
"""Period at which the operator side checks whether a command must leave."""
KEEP_ALIVE_S: Final = 0.02
"""Longest time between stiffnesses; commands are more frequent. In between the receiver extrapolates."""
LONGEST_HELD_S: Final = 4.0 * MOTION_PERIOD_S
"""Longest time between commands. Even if lost packets hold up five in a row, less than 0.1 s, the robot side's limit,
lies between two arrivals. At 20 ms four of them stopped the arm."""


def counted_s(silent_s: float) -> float:
    """Return the part of a silence that adds to the loop age, in seconds.

    A message that is not sent means that the receiver's extrapolation holds, which is then no older. One period of
    commands at full rate counts. The rest of a silence that the dead bands allow does not. Beyond it every millisecond
    counts: a silent link ages.
    """
    return silent_s - min(max(silent_s - MOTION_PERIOD_S, 0.0), KEEP_ALIVE_S - MOTION_PERIOD_S)
