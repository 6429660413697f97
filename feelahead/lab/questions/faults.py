"""What does the robot do when the stream breaks, grows old, repeats itself or comes from somebody else?

feelahead try faults

Each row in virtual time, exactly. Tests hold the same of real processes; docs/link.md says which.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from rich.console import RenderableType
from rich.table import Table as Shown

from feelahead.lab.faults import session, stream
from feelahead.lab.faults.fault import FAULTS
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from robot_side.compiled.warm_up import warm_up

ROWS = (session, stream)
"""Modules whose rows are registered by being imported."""


@dataclass(frozen=True)
class FaultSweep(Sweep):
    """Try every fault of the table, and tell what came of it."""


@dataclass(frozen=True)
class FaultCell:
    """One row of the table."""

    fault: str


def cells(_: FaultSweep) -> Iterator[FaultCell]:
    """Lay out the rows."""
    yield from map(FaultCell, FAULTS)


def run(cell: FaultCell, _: int) -> Iterator[Row]:
    """Try one row."""
    fault = FAULTS[cell.fault]
    yield {"safe_behaviour": fault.safe_behaviour, "number": fault.number} | fault.run()._asdict()


def show(_: FaultSweep, table: Table) -> Iterator[RenderableType]:
    """Show the table with what was measured."""
    shown = Shown(title="faults", show_lines=True)
    for heading in ("fault", "safe behaviour", "number to hold", "measured", "verdict"):
        shown.add_column(heading, overflow="fold")
    for row in table:
        said = (row[name] for name in ("fault", "safe_behaviour", "number", "measured"))
        shown.add_row(*said, "holds" if row["safe"] else "UNSAFE")
    yield shown


def failed(row: Row) -> bool:
    """Recognise a row in which the robot was unsafe."""
    return not row["safe"]


QUESTION = Question("try faults", FaultSweep, cells, run, show, failed=failed, prepare=warm_up)
