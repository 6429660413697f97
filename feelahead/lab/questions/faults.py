"""What does the robot do when a side, the link or a clock fails, for every fault of the table?

feelahead try faults
feelahead try faults --repeats 100 --only real

First the rows that virtual time decides, exactly; then real processes with kill -9, SIGSTOP, cut connections and
strangers, whose times are this machine's: run it on an idle one. Ten minutes with 100 repetitions.
"""

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Annotated, Final, Literal

import tyro
from msgspec import Meta
from rich.console import RenderableType
from rich.table import Table as Shown
from rich.text import Text

from feelahead.lab.faults import real_faults, session_faults, strangers, stream_faults
from feelahead.lab.faults.fault import REAL, VIRTUAL, Outcome
from feelahead.lab.faults.rig import RigError
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from robot_side.compiled.warm_up import warm_up

ROWS: Final = (stream_faults, session_faults, real_faults, strangers)
"""Modules whose rows are registered by being imported."""


@dataclass(frozen=True)
class FaultSweep(Sweep):
    """Try every fault of the table, and tell what came of it."""

    repeats: Annotated[int, Meta(ge=5, le=1000), tyro.conf.arg(metavar="N")] = 100
    """Decelerations of real processes to measure, all ways to break the stream together. --quick: 5."""
    only: Literal["all", "virtual", "real"] = "all"
    """Part of the table to try."""


@dataclass(frozen=True)
class FaultCell:
    """One row of the table."""

    part: Literal["virtual", "real"]
    fault: str
    repeats: int = 1


def cells(settings: FaultSweep) -> Iterator[FaultCell]:
    """Lay out the rows, those in virtual time first."""
    repeats = 5 if settings.quick else settings.repeats
    if settings.only != "real":
        warm_up()
        yield from (FaultCell("virtual", name) for name in VIRTUAL)
    if settings.only != "virtual":
        yield from (FaultCell("real", name, max(1, round(row.share * repeats))) for name, row in REAL.items())


def run(cell: FaultCell, _: int) -> Iterator[Row]:
    """Try one row; each starts other processes, so that none leaves anything behind."""
    fault = VIRTUAL[cell.fault] if cell.part == "virtual" else REAL[cell.fault]
    try:
        outcome = fault.run() if cell.part == "virtual" else fault.run(cell.repeats)
    except RigError as error:
        outcome = Outcome(False, str(error), judged=False)
    words = {"safe_behaviour": fault.safe_behaviour, "number": fault.number}
    yield words | asdict(outcome) | {"verdict": outcome.verdict}


def show(_: FaultSweep, table: Table) -> Iterator[RenderableType]:
    """Show the table with what was measured."""
    shown = Shown(title="faults", show_lines=True)
    for heading in ("fault", "safe behaviour", "number to hold", "measured", "verdict"):
        shown.add_column(heading, overflow="fold")
    for row in table:
        name = f"{row['fault']} (virtual)" if row["part"] == "virtual" else row["fault"]
        shown.add_row(name, row["safe_behaviour"], row["number"], row["measured"], row["verdict"])
    yield shown
    load = os.getloadavg()[0]
    yield Text(f"spreads: min/p50/p99/max in ms; {os.cpu_count()} processors, load {load:.1f}")


def failed(row: Row) -> bool:
    """Recognise a row in which the robot was unsafe."""
    return not row["safe"]


QUESTION = Question("try faults", FaultSweep, cells, run, show, failed=failed, timed=True)
