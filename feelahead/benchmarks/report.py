"""What a benchmark found: figures for the CSV, tables for people, goals met or missed."""

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.table import Table as RichTable

from common.files.output_file import output_file


@dataclass(frozen=True)
class Figure:
    """One number: a row of the CSV."""

    section: str
    method: str
    solid: str
    case: str
    quantity: str
    value: float
    unit: str


COLUMNS = tuple(column.name for column in fields(Figure))
"""The columns of the CSV."""


@dataclass(frozen=True)
class Table:
    """A table for people, in text that needs no more rounding; `note` says what its columns mean."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    note: str = ""


@dataclass(frozen=True)
class Goal:
    """What the kernels are to reach: `value` compared with `limit`."""

    claim: str
    value: float | None
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


def show_goals(console: Console, goals: Sequence[Goal]) -> None:
    """Print a line for each goal."""
    for goal in goals:
        colour = {"met": "green", "missed": "red"}.get(goal.verdict, "yellow")
        detail = f" ({goal.detail})" if goal.detail else ""
        line = (
            f"{goal.verdict:<13}{goal.claim}: {_or_dash(goal.value)}, {goal.compare} {short(goal.limit)} asked{detail}"
        )
        console.print(line, style=colour, highlight=False, markup=False)


def short(value: float) -> str:
    """Three digits, as people read them: 0.00123 as 1.23e-03, 1234.5 as 1234."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    if value == int(value) and abs(value) < 1e7:
        return str(int(value))
    if abs(value) >= 1000.0 and abs(value) < 1e7:
        return f"{value:.0f}"
    return f"{value:.3g}" if abs(value) >= 0.01 and abs(value) < 1000.0 else f"{value:.1e}"


def _or_dash(value: float | None) -> str:
    return "-" if value is None else short(value)


def write_csv(path: Path, figures: Sequence[Figure]) -> None:
    """One row for each figure under a heading of `COLUMNS`."""
    with output_file("--csv", path) as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows([*(getattr(figure, column) for column in COLUMNS)] for figure in figures)


def show(console: Console, table: Table) -> None:
    """Print a table."""
    shown = RichTable(title=table.title, title_justify="left", caption=table.note or None, caption_justify="left")
    for position, column in enumerate(table.columns):
        shown.add_column(column, justify="left" if position == 0 else "right", overflow="fold")
    for row in table.rows:
        shown.add_row(*row)
    console.print(shown)


def markdown(table: Table) -> str:
    """The table as Markdown under a heading."""
    lines = [f"## {table.title}", ""]
    if table.note:
        lines += [table.note, ""]
    lines += ["| " + " | ".join(table.columns) + " |", "|" + "---|" * len(table.columns)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in table.rows]
    return "\n".join([*lines, ""])
