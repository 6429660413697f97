"""Tables of a question's figures, as they are printed."""

from collections.abc import Iterable

from rich.box import MARKDOWN
from rich.table import Table

from feelahead.lab.goals import short


def shown(title: str, headings: Iterable[str], rows: Iterable[Iterable[str | float | None]]) -> Table:
    """Return a printable table; the first entry of a row is its name. Numbers get three digits, None becomes a dash."""
    table = Table(title=title, title_justify="left", box=MARKDOWN)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number else "left")
    for row in rows:
        table.add_row(*("-" if one is None else one if isinstance(one, str) else short(one) for one in row))
    return table
