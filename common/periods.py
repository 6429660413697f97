"""Periods of a side's turns: the default, and those that a machine takes which cannot keep a shorter one."""

from typing import Final

TURN_S: Final = 0.004
"""Default period, in seconds: a DualSense reports as often"""
PERIODS_S: Final = (0.001, 0.002, 0.004, 0.005, 0.008, 0.010, 0.020)
"""Periods to choose from, in seconds; any period between the first and the last may be asked for."""
EARLY: Final = 0.75
"""Share of a turn by which what is due may be early; else it would be late by more than the rest of a turn"""


def period_text(period_s: float) -> str:
    """Return a period as text, such as `4ms`."""
    return f"{1e3 * period_s:g}ms"


TURN: Final = period_text(TURN_S)
"""Default period as text"""
