"""Figures as people read them; what is not known stays unknown."""

from operator_side.terminal_view.history import number
from operator_side.terminal_view.signs import Signs


def share(value: float | None) -> float | None:
    """`value` between 0 and 1; None for what is no number."""
    known = number(value)
    return None if known is None else min(1.0, max(0.0, known))


def percent(value: float | None, signs: Signs) -> str:
    """A share of 0 to 1."""
    return f"{signs.unknown} %" if value is None else f"{100.0 * value:.0f} %"


def millimetres(value_m: float | None, signs: Signs) -> str:
    """A length given in metres."""
    known = number(value_m)
    return f"{signs.unknown} mm" if known is None else f"{round(1e3 * known)} mm"


def plain(value: float | None, signs: Signs, width: int = 0) -> str:
    """A figure with as many digits as say something."""
    known = number(value)
    if known is None:
        return f"{signs.unknown:>{width}}"
    digits = 0 if abs(known) >= 100.0 else 1 if abs(known) >= 1.0 or known == 0.0 else 2
    text = f"{known:.{digits}f}"
    return f"{text if len(text) < 9 else format(known, '.1e'):>{width}}"
