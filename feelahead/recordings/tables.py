"""Tables of a recording: one for each topic or kind of input, and a joined table; as CSV or Parquet, too.

The tables of topics keep their rates and stamps, from which delays can be computed. The joined table has an even rate
and one clock, so that it can be plotted at once. Each of its rows has the newest value of every column at that time.
"""

import csv
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError, RemoteProtocolError
from common.extras import require_packages
from common.recording.entries import Entry, Kind, unpack_block
from common.recording.reading import Recording
from feelahead.recordings.controller import read_value
from feelahead.recordings.dictionary import FILE, JOINED, PACKED, TIME, dictionary, parents_of
from feelahead.recordings.rows import ArmRow, ControllerRow, FeltRow
from operator_side.controller.feel import FREE_TRIGGER, Feel, Strengths, met
from operator_side.controller.state import ControllerState
from robot_side.recording.arm_states import unpack_state

JOINED_HZ: Final = 100.0
_NANOSECONDS: Final = 1e-9
_MOST_COLUMNS: Final = 5000
_ROWS_OF_NOTHING: Final = 100_000
_ROWS_A_MESSAGE: Final = 100
"""Rows of a joined table that may come without any message, and for each message"""
_STAMPS: Final = ("time_s", "now_s", "sent_s", "sequence", "side")
"""Columns that the joined table leaves out."""
_TOPICS: Final = (
    *("/stiffness", "/command", "/ages", "/telemetry", "/enlargement", "/overlap", "/unseen"),
    *("/robot/status", "/operator/status", "/operator/facts", "/episode"),
    *("/robot/inputs", "/operator/inputs"),
)
_JOINED: Final = (
    *("stiffness", "command", "felt", "controller", "arm"),
    *("telemetry", "ages", "enlargement", "overlap", "unseen", "robot_status"),
)


@dataclass
class Table:
    """Rows in order of time; a column that a row lacks counts as None."""

    times_s: list[float] = field(default_factory=list)
    """Time of each row since the recording began"""
    rows: list[dict[str, Any]] = field(default_factory=list)
    _columns: dict[str, None] = field(default_factory=dict)

    def add(self, time_s: float, row: dict[str, Any]) -> None:
        """Append a row; ConfigurationError if the table would have too many columns."""
        self.times_s.append(time_s)
        self.rows.append(row)
        if not self._columns.keys() >= row.keys():
            self._columns |= dict.fromkeys(row)
            if len(self._columns) > _MOST_COLUMNS:
                raise ConfigurationError(f"a topic has {len(self._columns)} columns; valid: at most {_MOST_COLUMNS}")

    def columns(self) -> list[str]:
        """Return the names of all rows' columns, in order of first use."""
        return list(self._columns)

    def values(self, name: str) -> Iterator[Any]:
        """Yield a column, None for missing values."""
        return (row.get(name) for row in self.rows)

    def numbers(self, name: str) -> FloatArray:
        """Return a column as numbers; NaN for missing values and texts."""
        return _numbers(self.values(name), len(self.rows))

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame with the time since the recording began as its index."""
        return _frame(self, self.times_s)

    def sorted(self) -> "Table":
        """Return the table sorted by time; messages of the two sides are recorded slightly out of order."""
        order = np.argsort(np.array(self.times_s), kind="stable")
        return Table([self.times_s[i] for i in order], [self.rows[i] for i in order], self._columns)


@dataclass(frozen=True)
class Joined:
    """Table at an even rate, made from others column by column, as it is much larger than they are."""

    times_s: FloatArray
    _sources: Mapping[str, tuple[Table, str, list[int]]]
    """For each column its table, its name there, and the newest row at each time; -1 before the first one"""

    def columns(self) -> list[str]:
        """Return the columns' names."""
        return list(self._sources)

    def values(self, name: str) -> Iterator[Any]:
        """Yield a column, None for missing values and for an unknown column."""
        if name not in self._sources:
            return iter([None] * len(self.times_s))
        table, column, newest = self._sources[name]
        return (table.rows[row].get(column) if row >= 0 else None for row in newest)

    def numbers(self, name: str) -> FloatArray:
        """Return a column as numbers; NaN for missing values and texts."""
        return _numbers(self.values(name), len(self.times_s))

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame with the time since the recording began as its index."""
        return _frame(self, self.times_s)


def _frame(table: "Table | Joined", times_s: Sequence[float] | FloatArray) -> Any:
    require_packages("to_pandas", "pandas", extra="study")
    import pandas as pd  # noqa: PLC0415  # its users have it

    values = {name: list(table.values(name)) for name in table.columns()}
    return pd.DataFrame(values, index=pd.Index(times_s, name=TIME))


def _numbers(values: Iterator[Any], count: int) -> FloatArray:
    return np.fromiter((value if isinstance(value, int | float) else np.nan for value in values), np.float64, count)


@dataclass
class Tables:
    """Tables of a recording, without pictures and scenes."""

    began_s: float
    """Start of the recording on the wall clock"""
    duration_s: float
    by_name: Mapping[str, Table]

    def table(self, name: str) -> Table:
        """Return the table of that name; an empty table if there is none."""
        return self.by_name.get(name) or Table()

    def joined(self, rate_hz: float = JOINED_HZ) -> Joined:
        """Return one table at an even rate, whose rows have the newest value of every column at their time.

        ConfigurationError if it would have far more rows than there are messages, as by a stamp that is wrong.
        """
        rows, messages = self.duration_s * rate_hz, sum(len(table.rows) for table in self.by_name.values())
        if rows > _ROWS_OF_NOTHING + _ROWS_A_MESSAGE * messages:
            raise ConfigurationError(
                f"spans {self.duration_s:.0f} s with {messages} messages; valid: a message or more for each"
                f" {_ROWS_A_MESSAGE} rows of {1e3 / rate_hz:g} ms"
            )
        times_s = np.arange(0.0, self.duration_s, 1.0 / rate_hz)
        sources: dict[str, tuple[Table, str, list[int]]] = {}
        for name in _JOINED:
            table = self.table(name)
            newest = (np.searchsorted(np.array(table.times_s), times_s + 1e-9, side="right") - 1).tolist()
            shown = (column for column in table.columns() if column not in _STAMPS)
            sources |= {f"{name}.{column}": (table, column, newest) for column in shown}
        return Joined(times_s, sources)


def read_tables(recording: Recording) -> Tables:
    """Read all tables of a recording; pictures and scenes are left out."""
    tables: dict[str, Table] = {}
    first_ns = last_ns = recording.began_ns
    zones: dict[str, Strengths] = {"l2": FREE_TRIGGER, "r2": FREE_TRIGGER}
    recording.require(_TOPICS)
    for message in recording.messages(_TOPICS):
        last_ns = max(last_ns, message.log_ns)
        time_s = _NANOSECONDS * (message.log_ns - first_ns)
        if not message.topic.endswith("/inputs"):
            name = message.topic[1:].replace("/", "_")
            row = dict(_flat(msgspec.json.decode(message.content), parents_of(name)))
            tables.setdefault(name, Table()).add(time_s, row)
            continue
        block = unpack_block(message.content)
        for entry in block.unpacked():
            # A block has the time stamp of its first entry.
            if (found := _row(entry, zones)) is not None:
                name, values = found
                row = dict(_flat(msgspec.to_builtins(values), parents_of(name)))
                tables.setdefault(name, Table()).add(time_s + entry.now_s - block.first_s, row)
    sorted_tables = {name: table.sorted() for name, table in sorted(tables.items())}
    duration_s = _NANOSECONDS * (last_ns - first_ns)
    return Tables(_NANOSECONDS * first_ns, duration_s, sorted_tables)


def _row(entry: Entry, zones: dict[str, Strengths]) -> tuple[str, msgspec.Struct] | None:
    """Return the name of the table and the row for one recorded input; keep the zones last written in `zones`.

    None for an input that is invalid, or that other topics contain.
    """
    try:
        if entry.kind == Kind.STATE:
            state = unpack_state(entry.content)
            positions, velocities = (
                tuple(state.joint_positions_rad.tolist()),
                tuple(state.joint_velocities_rad_s.tolist()),
            )
            return "arm", ArmRow(positions, velocities, state.gripper_opening_m, state.gripper_holding)
        if entry.kind == Kind.HANDS:
            hands = read_value(entry.content, ControllerState)
            meets = met(zones["l2"], hands.l2), met(zones["r2"], hands.r2)
            return "controller", ControllerRow(hands.l2, hands.r2, *meets)
        if entry.kind == Kind.TOLD:
            feel = read_value(entry.content, Feel)
            zones.update((name, strengths) for name, strengths in (("l2", feel.l2), ("r2", feel.r2)) if strengths)
            return "felt", msgspec.convert(zones, FeltRow)
    except (RemoteProtocolError, ValueError):
        return None
    return None


def _flat(values: Any, parents: Collection[str], name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield nested values with flat names: `{"l2": {"fast_m": [1, 2]}}` as `l2.fast_m.0` and `l2.fast_m.1`.

    Overlaps have the names of their objects in front. parents: names that have others below them. Such a value may be
    absent as a whole, which makes no column. Nor do packed parts of messages.
    """
    if name.rpartition(".")[2] in PACKED or (values is None and name in parents):
        return
    if isinstance(values, dict):
        if "object" in values:
            thing = values["object"]
            yield from ((f"{thing}.{key}", value) for key, value in values.items() if key != "object")
            return
        for key, value in values.items():
            yield from _flat(value, parents, f"{name}.{key}" if name else key)
    elif isinstance(values, list | tuple):
        for index, value in enumerate(values):
            yield from _flat(value, parents, f"{name}.{index}")
    else:
        yield name, values


def export_csv(tables: Tables, folder: Path) -> list[str]:
    """Write all tables as CSV into `folder`; return the files' names. Missing values become empty fields."""
    written = []
    for name, table in _all(tables):
        columns = table.columns()
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([TIME, *columns])
            for time_s, *values in zip(table.times_s, *map(table.values, columns), strict=True):
                numbers = (int(value) if isinstance(value, bool) else value for value in values)
                writer.writerow([f"{time_s:.9f}", *numbers])
        written.append(f"{name}.csv")
    return [*written, _write_dictionary(tables, folder)]


def export_parquet(tables: Tables, folder: Path) -> list[str]:
    """Write all tables as Parquet into `folder`; return the files' names. Missing values become null."""
    import pyarrow  # noqa: PLC0415
    from pyarrow import parquet  # noqa: PLC0415

    written = []
    for name, table in _all(tables):
        columns: dict[str, Any] = {TIME: table.times_s}
        columns |= {column: pyarrow.array(_one_kind(list(table.values(column)))) for column in table.columns()}
        parquet.write_table(pyarrow.table(columns), folder / f"{name}.parquet", compression="zstd")
        written.append(f"{name}.parquet")
    return [*written, _write_dictionary(tables, folder)]


def _write_dictionary(tables: Tables, folder: Path) -> str:
    columns = ((name, table.columns()) for name, table in _all(tables))
    (folder / FILE).write_text(dictionary(columns), encoding="utf-8")
    return FILE


def _all(tables: Tables) -> list[tuple[str, Table | Joined]]:
    return [*tables.by_name.items(), (JOINED, tables.joined())]


def _one_kind(values: list[Any]) -> list[Any]:
    """Convert a column of mixed types to one type: numbers to floats; everything to text if any value is no number."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {bool} or kinds <= {int} or kinds <= {str}:
        return values
    if kinds <= {int, float}:
        return [None if value is None else float(value) for value in values]
    return [None if value is None else str(value) for value in values]
