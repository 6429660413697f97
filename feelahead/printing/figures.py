"""Figures and tables of figures, as they are printed."""

import math
from collections.abc import Iterable

from rich.box import MARKDOWN
from rich.table import Table


def shown(title: str, headings: Iterable[str], rows: Iterable[Iterable[str | float | None]]) -> Table:
    """Return a printable table; the first entry of a row is its name. Numbers get three digits, None becomes a dash."""
    table = Table(title=title, title_justify="left", box=MARKDOWN)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number else "left")
    for row in rows:
        table.add_row(*("-" if one is None else one if isinstance(one, str) else short(one) for one in row))
    return table


def short(value: float) -> str:
    """Return `value` as text with two to four digits: 0.00123 as 1.2e-03, 0.123 as 0.123, 1234.5 as 1234."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    if value == int(value) and abs(value) < 1e7:
        return str(int(value))
    if 1000.0 <= abs(value) < 1e7:
        return f"{value:.0f}"
    return f"{value:.3g}" if 0.01 <= abs(value) < 1000.0 else f"{value:.1e}"
