"""Highest speed at which touching the target is allowed: one rule for zones and for the rumble."""

from typing import Final

_MOST_M_S: Final = 0.045
_SHARE: Final = 0.18


def touch_speed_m_s(full_speed_m_s: float) -> float:
    """Return v_touch, below which the slow list applies: 45 mm/s, or 18 % of `full_speed_m_s` if that is less."""
    return min(_MOST_M_S, _SHARE * full_speed_m_s)
