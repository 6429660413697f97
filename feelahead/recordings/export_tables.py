"""A recording as CSV or Parquet: a folder with a file for each topic at its own rate, and `joined` at 100 Hz.

A researcher wants both: rates and stamps as they were, to compute delays from; and one table on one clock, to load
and plot in a line. The joined one holds at each moment the newest of everything, and nothing before its first.
"""

import csv
from pathlib import Path
from typing import Any, Final

from feelahead.recordings.tables import Table, Tables

JOINED: Final = "joined"


def export_csv(tables: Tables, folder: Path) -> list[str]:
    """Write the tables; the files' names. What is not there is an empty field."""
    written = []
    for name, table in _all(tables):
        columns = table.columns()
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["recording_s", *columns])
            for time_s, row in zip(table.times_s, table.rows, strict=True):
                writer.writerow([f"{time_s:.9f}", *(_text(row.get(column)) for column in columns)])
        written.append(f"{name}.csv")
    return written


def export_parquet(tables: Tables, folder: Path) -> list[str]:
    """Write the tables; the files' names. What is not there is null."""
    import pyarrow  # noqa: PLC0415
    from pyarrow import parquet  # noqa: PLC0415

    written = []
    for name, table in _all(tables):
        columns: dict[str, Any] = {"recording_s": table.times_s}
        columns |= {column: _one_kind([row.get(column) for row in table.rows]) for column in table.columns()}
        parquet.write_table(pyarrow.table(columns), folder / f"{name}.parquet", compression="zstd")
        written.append(f"{name}.parquet")
    return written


def _all(tables: Tables) -> list[tuple[str, Table]]:
    return [*tables.by_name.items(), (JOINED, tables.joined())]


def _text(value: Any) -> Any:
    if value is None:
        return ""
    return int(value) if isinstance(value, bool) else value


def _one_kind(values: list[Any]) -> list[Any]:
    """Numbers as floats, and everything as text where there is any text: a column has one type."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {bool} or kinds <= {int} or kinds <= {str}:
        return values
    if kinds <= {int, float}:
        return [None if value is None else float(value) for value in values]
    return [None if value is None else str(value) for value in values]
