"""Marked tables of docs/, made from the CSV files in figures/, which `make figures` measures.

Each table stands between two markers, of which the first names its file.
"""

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from feelahead.lab.measurements import approaches, coverages, looks, people, printed, studies
from feelahead.lab.measurements.lines import Lines
from feelahead.lab.table import Table

ROOT: Final = Path(__file__).parents[3]
DOCUMENTS: Final = tuple(
    ROOT / "docs" / name for name in ("measurements.md", "feel.md", "depth.md", "study.md", "benchmarks.md")
)
FIGURES: Final = ROOT / "figures"
MARKED: Final = re.compile(
    r"(<!-- (?P<name>(?P<file>\w+)[^\n]*?): by make figures -->\n).*?(?P<end><!-- end -->)", re.DOTALL
)
_NAMES: Final = ("case", "setting")
_PLAIN: Final = {"": None, "True": True, "False": False}


def read(name: str, figures: Path = FIGURES) -> Table:
    """Return the table of a CSV file; figures are numbers again, but names such as 1e-3 in `_NAMES` are not."""
    with (figures / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return Table({column: _value(column, text) for column, text in row.items()} for row in csv.DictReader(file))


def _value(column: str, text: str) -> Any:
    try:
        return text if column in _NAMES else _PLAIN[text] if text in _PLAIN else float(text)
    except ValueError:
        return text


def written(text: str, figures: Path = FIGURES) -> str:
    """Return a document with each marked table made anew, and the commit of its figures.

    A table whose file is missing stays as it is.
    """
    commits = dict(line.split() for line in (figures / "commits").read_text(encoding="utf-8").splitlines())

    def anew(found: re.Match[str]) -> str:
        if not (figures / f"{found['file']}.csv").exists():
            return found[0]
        rows = [
            [cell.replace("|", "\\|") for cell in row] for row in TABLES[found["name"]](read(found["file"], figures))
        ]
        lines = [f"| {' | '.join(row)} |" for row in rows]
        lines.insert(1, "|---" * len(rows[0]) + "|")
        return "\n".join([found[1] + f"Commit {commits[found['file']]}:\n", *lines, found["end"]])

    return MARKED.sub(anew, text)


TABLES: Final[dict[str, Callable[[Table], Lines]]] = {
    "haptics": people.haptics,
    "camera": people.haptics,
    "demo": people.demo,
    "definition": looks.definition,
    "tick": looks.tick,
    "cover": looks.cover,
    "stability": looks.stability,
    "tiles": looks.tiles,
    "approach": approaches.approach,
    "coverage": coverages.coverage,
    "coverage: alarms": coverages.alarms,
    "laws": coverages.laws,
    "error": approaches.error,
    "depth": coverages.depth,
    "depth: other errors": coverages.other_errors,
    "haptics_depth": people.haptics,
    "study": studies.outcomes,
    "contrasts": studies.contrasts,
    **printed.TABLES,
}
