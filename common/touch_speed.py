"""Highest speed at which touching the target is allowed; the triggers' zones and the rumble use the same rule."""

from typing import Final

_MOST_M_S: Final = 0.045
_SHARE: Final = 0.18


def touch_speed_m_s(full_speed_m_s: float) -> float:
    """Return v_touch, below which the slow list of onset distances applies.

    It is 45 mm/s, or 18 % of `full_speed_m_s` if that is less.
    """
    return min(_MOST_M_S, _SHARE * full_speed_m_s)
