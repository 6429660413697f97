"""Goals: upper or lower limits of figures, and whether they are met."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from rich.console import Console


@dataclass(frozen=True)
class Goal:
    """One figure with its limit."""

    claim: str
    value: float | None
    """Measured figure; None: not measured."""
    limit: float
    compare: Literal["at most", "at least"] = "at most"
    detail: str = ""

    @property
    def verdict(self) -> str:
        """`met`, `missed` or `not measured`."""
        if self.value is None or math.isnan(self.value):
            return "not measured"
        reached = self.value <= self.limit if self.compare == "at most" else self.value >= self.limit
        return "met" if reached else "missed"


def show_goals(console: Console, goals: Iterable[Goal]) -> None:
    """Print a line for each goal."""
    for goal in goals:
        value = "-" if goal.value is None else short(goal.value)
        detail = f" ({goal.detail})" if goal.detail else ""
        console.print(
            f"{goal.verdict:<13}{goal.claim}: {value}, {goal.compare} {short(goal.limit)} asked{detail}",
            style={"met": "green", "missed": "red"}.get(goal.verdict, "yellow"),
        )


def short(value: float) -> str:
    """Round to three digits: 0.00123 to 1.23e-03, 1234.5 to 1234."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    if value == int(value) and abs(value) < 1e7:
        return str(int(value))
    if 1000.0 <= abs(value) < 1e7:
        return f"{value:.0f}"
    return f"{value:.3g}" if 0.01 <= abs(value) < 1000.0 else f"{value:.1e}"
