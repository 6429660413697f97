"""Goals: upper or lower limits for measured figures, and whether the figures meet them."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from rich.console import Console

from feelahead.printing.figures import short


@dataclass(frozen=True)
class Goal:
    """One measured figure with its upper or lower limit."""

    claim: str
    value: float | None
    """Measured value; None: not measured"""
    limit: float
    compare: Literal["at most", "at least"] = "at most"
    detail: str = ""

    @property
    def verdict(self) -> str:
        """Whether the goal is `met`, `missed` or `not measured`."""
        if self.value is None or math.isnan(self.value):
            return "not measured"
        reached = self.value <= self.limit if self.compare == "at most" else self.value >= self.limit
        return "met" if reached else "missed"


def show_goals(console: Console, goals: Iterable[Goal]) -> None:
    """Print a line for each goal: verdict, claim, value and limit."""
    for goal in goals:
        value = "-" if goal.value is None else short(goal.value)
        detail = f" ({goal.detail})" if goal.detail else ""
        console.print(
            f"{goal.verdict:<13}{goal.claim}: {value}, {goal.compare} {short(goal.limit)} asked{detail}",
            style={"met": "green", "missed": "red"}.get(goal.verdict, "yellow"),
        )
