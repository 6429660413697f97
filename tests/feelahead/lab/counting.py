"""Question for tests of the engine, whose cells need no time; files can hold cells, make them fail or kill them."""

import os
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table as Shown

from common.errors import ConfigurationError, FeelaheadError
from feelahead.lab.sweep import Question, Sweep, generator
from feelahead.lab.table import Row, Table


@dataclass(frozen=True)
class Counting(Sweep):
    numbers: tuple[int, ...] = (1, 2, 3)
    folder: str = ""
    """Folder in which each cell writes a file. A file with a cell's name says what the cell must do: `kill`, `fail` or
    `refuse`. While there is a file `hold-NUMBER`, the cells of this number do not end."""


@dataclass(frozen=True)
class Cell:
    number: int
    folder: str


def cells(settings: Counting) -> Iterator[Cell]:
    yield from (Cell(number, settings.folder) for number in settings.numbers)


def held(folder: Path, number: int) -> Path:
    return folder / f"hold-{number}"


def run(cell: Cell, seed: int) -> Iterator[Row]:
    if cell.folder:
        order = Path(cell.folder) / f"{cell.number}-{seed}"
        asked = order.read_text() if order.exists() else ""
        order.write_text("done")
        if asked == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        if asked == "fail":
            raise FeelaheadError("as asked")
        if asked == "refuse":
            raise ConfigurationError("as asked")
    while cell.folder and held(Path(cell.folder), cell.number).exists():
        signal.sigtimedwait((), 0.02)
    drawn = generator(cell.number, seed).random(2)
    yield from (
        {"part": part, "value": float(value), "none": None, "parts": [1, 2]} for part, value in enumerate(drawn)
    )


def show(_: Counting, table: Table) -> Iterator[Shown]:
    yield Shown("rows", title=f"{len(table)} rows")


QUESTION = Question("try counting", Counting, cells, run, show)
TIMED = Question("try counting", Counting, cells, run, show, timed=True)
