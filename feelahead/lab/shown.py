"""Tables for people."""

from collections.abc import Iterable

from rich.box import MARKDOWN
from rich.table import Table

from feelahead.lab.goals import short


def shown(title: str, headings: Iterable[str], rows: Iterable[Iterable[str | float | None]]) -> Table:
    """Return a table whose first column names the row; numbers have three digits, and None is a dash."""
    table = Table(title=title, title_justify="left", box=MARKDOWN)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number else "left")
    for row in rows:
        table.add_row(*("-" if one is None else one if isinstance(one, str) else short(one) for one in row))
    return table
