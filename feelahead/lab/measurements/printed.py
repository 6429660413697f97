"""Tables and goals as a command prints them."""

from collections.abc import Callable, Iterable
from typing import Any, Final, NamedTuple

from rich.table import Table as Shown

from feelahead.lab.goals import Goal
from feelahead.lab.measurements.lines import Lines
from feelahead.lab.questions import accuracy, felt, overlap, stability, tick
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Table
from feelahead.printing.figures import short


class Asked(NamedTuple):
    """A question as it was asked, and how the title of one of its tables begins."""

    question: Question[Any, Any]
    settings: Sweep
    title: str = ""

    def goals(self, rows: Table) -> Lines:
        """Yield a row for each goal."""
        yield "goal", "measured", "asked", ""
        goals: Iterable[Goal] = self.question.goals(self.settings, _present(rows))
        for goal in goals:
            value = "-" if goal.value is None else short(goal.value)
            where = f" ({goal.detail})" if goal.detail else ""
            yield goal.claim, value + where, f"{goal.compare} {short(goal.limit)}", goal.verdict

    def table(self, rows: Table) -> Lines:
        """Yield the printed table."""
        for shown in self.question.show(self.settings, _present(rows)):
            if isinstance(shown, Shown) and str(shown.title).startswith(self.title):
                yield [str(column.header) for column in shown.columns]
                yield from zip(*([str(cell) for cell in column.cells] for column in shown.columns), strict=True)
                return


def _present(rows: Table) -> Table:
    """Return the rows without the entries that a CSV file leaves empty."""
    return Table({name: value for name, value in row.items() if value is not None} for row in rows)


_OVERLAP: Final = Asked(overlap.QUESTION, overlap.OverlapSweep())
TABLES: Final[dict[str, Callable[[Table], Lines]]] = {
    "tick: goals": Asked(tick.QUESTION, tick.TickSweep()).goals,
    "overlap": _OVERLAP.goals,
    "overlap: run time": _OVERLAP._replace(title="run time, ns a pair, gradients").table,
    "overlap: volumes alone": _OVERLAP._replace(title="run time, ns a pair, volumes").table,
    "overlap: errors of volumes": _OVERLAP._replace(title="and the worst error").table,
    "overlap: worst errors": _OVERLAP._replace(title="worst errors").table,
    "overlap: shallow": _OVERLAP._replace(title="shallow").table,
    "overlap: adversarial": _OVERLAP._replace(title="adversarial").table,
    "overlap: meshes": _OVERLAP._replace(title="a torus").table,
    "accuracy": Asked(accuracy.QUESTION, accuracy.AccuracySweep()).table,
    "stability: closed loop": lambda rows: Asked(stability.QUESTION, stability.StabilitySweep()).table(
        rows.where(part=stability.CLOSED_LOOP)
    ),
    "shared": Asked(felt.QUESTION, felt.FeltSweep(shared=True)).table,
}
