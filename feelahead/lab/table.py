"""One tidy table: a row for each measurement, a column for each setting and figure."""

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from common.errors import ConfigurationError
from common.extras import require_packages
from common.files.output_file import output_file

Row = dict[str, Any]
"""Figures by name, as JSON values. Scalars go to `--summary`, `--csv` and `--parquet`, lists and nested
tables only to `--summary`."""

_SCALARS = (str, int, float, bool, type(None))


class Table:
    """Rows, not to be changed, in the order of cells, then of seeds, then of measurements."""

    def __init__(self, rows: Iterable[Row]) -> None:
        self.rows: Sequence[Row] = tuple(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    @property
    def columns(self) -> list[str]:
        """Names of all scalar figures, in the order in which they first occur."""
        names = {name: None for row in self.rows for name, value in row.items() if isinstance(value, _SCALARS)}
        return list(names)

    def values(self, name: str) -> list[Any]:
        """Return the figures of one column; rows without the column, or with None in it, are left out."""
        return [row[name] for row in self.rows if row.get(name) is not None]

    def lines(self, *names: str) -> Iterator[list[Any]]:
        """Yield for each row its figures in the columns `names`; None for a column that the row lacks."""
        return ([row.get(name) for name in names] for row in self.rows)

    def where(self, **equal: Any) -> "Table":
        """Return the table of those rows whose columns have the given values."""
        return Table(row for row in self.rows if all(row.get(name) == value for name, value in equal.items()))

    def groups(self, *names: str) -> Iterator[tuple[tuple[Any, ...], "Table"]]:
        """Yield, for each combination of values of the columns `names`, the values and the table of its rows.

        The combinations come in the order in which they first occur.
        """
        found: dict[tuple[Any, ...], list[Row]] = {}
        for row in self.rows:
            found.setdefault(tuple(row.get(name) for name in names), []).append(row)
        for key, rows in found.items():
            yield key, Table(rows)

    def write_csv(self, path: Path) -> None:
        """Write the scalar columns as CSV; an absent figure becomes an empty field."""
        with output_file("--csv", path) as file:
            writer = csv.DictWriter(file, self.columns, extrasaction="ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)

    def write_parquet(self, path: Path) -> None:
        """Write the scalar columns as Parquet; ConfigurationError if pyarrow is missing."""
        require_packages("--parquet", "pyarrow", extra="experiments")
        import pyarrow as pa  # noqa: PLC0415  # large, and only asked for by name
        from pyarrow import parquet  # noqa: PLC0415

        columns = {name: [row.get(name) for row in self.rows] for name in self.columns}
        new = path.with_name(f".{path.name}.new")
        try:
            # An existing file is kept until the new one is complete.
            parquet.write_table(pa.table(columns), new)
            new.replace(path)
        except (OSError, pa.ArrowException) as error:
            raise ConfigurationError(f"--parquet {path}: cannot be written: {error}") from error
        finally:
            new.unlink(missing_ok=True)
