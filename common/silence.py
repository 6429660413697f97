"""The longest silence that says something, and its share in a loop's age: the same for both sides."""

from typing import Final

MOTION_PERIOD_S: Final = 1.0 / 250.0
"""The period at which the operator side looks whether a command has to leave."""
KEEP_ALIVE_S: Final = 0.02
"""A stiffness leaves at least this often, and a command more often; in between the receiver extrapolates."""
LONGEST_HELD_S: Final = 4.0 * MOTION_PERIOD_S
"""A command leaves at least this often: with five in a row on connections that a lost packet holds up, less than 0.1 s,
the robot side's limit, lie between the two that arrive. At 20 ms four of them stopped the arm."""


def counted_s(silent_s: float) -> float:
    """Give the part of a silence that adds to a loop's age, in seconds.

    A message that does not leave says that all is as the receiver extrapolates, which is then no older. One period of
    commands at full rate counts, as it always did. The rest of a silence that the deadbands allow does not. Beyond it
    every millisecond counts: a link that falls silent ages.
    """
    return silent_s - min(max(silent_s - MOTION_PERIOD_S, 0.0), KEEP_ALIVE_S - MOTION_PERIOD_S)
