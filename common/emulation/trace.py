"""Recorded delays of a real link, applied again message by message."""

import contextlib
import csv
import gzip
import io
import itertools
import math
import zlib
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NoReturn, cast

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.files.regular_file import regular_file

_MOST_ROWS = 1_000_000
_LONGEST_LINE = 10_000
_LARGEST_NUMBER = 1e19
_NUMBERS = ("seq", "sent_ns", "received_ns", "delay_ns")
_COLUMNS = (
    "a heading line and the columns delay_ns, or sent_ns and received_ns; also seq if rows are not in order of sending"
)


_Refuse = Callable[..., NoReturn]
"""Function of what is wrong, what is valid, and the row's number, if any, that raises the error"""


@dataclass(frozen=True)
class Trace:
    """Recorded delays: the n-th message gets the n-th delay; after the last one they begin again."""

    delays_s: tuple[float | None, ...]
    """Delay of each recorded message, in order of sending; None for a lost message."""

    def __post_init__(self) -> None:
        if all(delay_s is None for delay_s in self.delays_s):
            raise ValueError("delays_s holds no delay, so no message arrives; valid: one delay or more")

    @classmethod
    def read(cls, path: Path, field: str) -> "Trace":
        """Read a CSV file with the column delay_ns, or with sent_ns and received_ns.

        A row is a message; an empty delay or time of reception means that it was lost. Rows are sorted by seq if there
        is such a column, else by sent_ns if there is that, else left as they are. A missing seq is a lost message. A
        file whose name ends in .gz is unpacked. Raises ConfigurationError, in one line that begins with `field`, for
        any other content.
        """
        _, delays_s = read_samples(path, field)
        try:
            return cls(tuple(None if math.isnan(delay_s) else delay_s for delay_s in delays_s.tolist()))
        except ValueError as error:
            raise ConfigurationError(
                f"{field}: {path}: no message in it arrives; valid: one message that arrives, or more"
            ) from error


def read_samples(path: Path, field: str) -> tuple[FloatArray, FloatArray]:
    """Read the messages of a trace in order of sending; file and errors are those of `Trace.read`.

    Return times of sending (n,) on the recording's clock, NaN if unknown, and delays (n,), NaN for lost messages; both
    in seconds.
    """

    def refuse(what: str, valid: str, row: int | None = None) -> NoReturn:
        where = "" if row is None else f" row {row + 1}:"
        raise ConfigurationError(f"{field}: {str(path)!r}{where} {what}; valid: {valid}")

    try:
        columns = _read_columns(path, refuse)
    except ConfigurationError:
        raise
    except (OSError, EOFError, ValueError, zlib.error, csv.Error) as error:
        refuse(
            f"cannot be read: {getattr(error, 'strerror', None) or 'it is no CSV file'}", f"a CSV file with {_COLUMNS}"
        )
    sent_ns = columns.get("sent_ns", np.full(len(next(iter(columns.values()))), np.nan))
    delays_ns = columns["delay_ns"] if "delay_ns" in columns else columns["received_ns"] - sent_ns
    for number in np.flatnonzero(delays_ns < 0.0)[:1].tolist():
        refuse(f"the delay is {delays_ns[number]:.0f} ns", "0 ns or more", number)
    key = next((name for name in ("seq", "sent_ns") if name in columns), None)
    if key is None:
        return 1e-9 * sent_ns, 1e-9 * delays_ns
    keys = columns[key]
    for number in np.flatnonzero(np.isnan(keys))[:1].tolist():
        refuse(f"{key} is empty", "a number", number)
    order = np.argsort(keys, kind="stable")
    keys, sent_ns, delays_ns = keys[order], sent_ns[order], delays_ns[order]
    if key == "seq" and len(keys):
        if keys[-1] - keys[0] >= _MOST_ROWS:
            refuse(f"seq reaches from {keys[0]:.0f} to {keys[-1]:.0f}", f"up to {_MOST_ROWS} messages")
        # A lost message has no row; it was sent evenly between its neighbours.
        places = np.rint(keys - keys[0]).astype(np.intp)
        every = np.arange(places[-1] + 1)
        found_ns, delays_ns = delays_ns, np.full(len(every), np.nan)
        delays_ns[places] = found_ns
        sent_ns = np.interp(every, places, sent_ns)
    return 1e-9 * sent_ns, 1e-9 * delays_ns


def _read_columns(path: Path, refuse: _Refuse) -> dict[str, FloatArray]:
    """Return the columns of numbers, (n,) each; NaN for empty entries."""
    with regular_file(path) as file:
        table = csv.reader(_lines(path, file, refuse))
        names = next(table, [])
        if not ("delay_ns" in names or {"sent_ns", "received_ns"} <= set(names)):
            refuse(f"has the columns {', '.join(sorted(names))[:80] or 'none'}", _COLUMNS)
        places = {name: place for place, name in enumerate(names) if name in _NUMBERS}
        values = {name: array("d") for name in places}
        for number, row in enumerate(filter(None, table)):
            for name, place in places.items():
                entry, value = row[place].strip() if place < len(row) else "", math.nan
                if entry:
                    with contextlib.suppress(ValueError):
                        value = float(entry)
                    if not abs(value) < _LARGEST_NUMBER:
                        refuse(f"{name} = {entry[:40]!r}", "a number, or nothing for a lost message", number)
                values[name].append(value)
        return {name: np.array(column) for name, column in values.items()}


def _lines(path: Path, file: BinaryIO, refuse: _Refuse) -> Iterator[str]:
    """Yield the file's lines, unpacked one by one: a small file may unpack to any size."""
    packed = cast("BinaryIO", gzip.GzipFile(fileobj=file)) if path.suffix == ".gz" else file
    with io.TextIOWrapper(packed, encoding="utf-8-sig") as text:
        for count in itertools.count():
            line = text.readline(_LONGEST_LINE + 1)
            if not line:
                return
            if count > _MOST_ROWS:
                refuse("has too many rows", f"up to {_MOST_ROWS} rows")
            if len(line) > _LONGEST_LINE:
                refuse("has too long a line", f"up to {_LONGEST_LINE} characters", count - 1)
            yield line
