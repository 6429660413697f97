"""Recorded delays of a real link, applied again message by message."""

import csv
import gzip
import itertools
import math
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from common.errors import ConfigurationError
from common.files.regular_file import read_regular_file

_MOST_ROWS = 1_000_000
_LARGEST_BYTES = 100 * _MOST_ROWS
_COLUMNS = "delay_ns, or sent_ns and received_ns, with a heading, and seq where rows are not in order of sending"


@dataclass(frozen=True)
class Trace:
    """Recorded delays: the n-th message gets the n-th delay; after the last one they begin again."""

    delays_s: tuple[float | None, ...]
    """Delay of each recorded message, in order of sending; None for a lost message."""

    def __post_init__(self) -> None:
        if all(delay_s is None for delay_s in self.delays_s):
            raise ValueError("delays_s holds no delay; valid: one message that arrives, or more")

    @classmethod
    def read(cls, path: Path, field: str) -> "Trace":
        """Read a CSV file with the column delay_ns, or with sent_ns and received_ns.

        A row is a message; an empty delay or time of reception means that it was lost. Rows are sorted by seq if there
        is such a column, else by sent_ns if there is that, else left as they are. A missing seq is a lost message. A
        file whose name ends in .gz is unpacked. Raises ConfigurationError, in one line that begins with `field`, for
        any other content.
        """
        rows = read_samples(path, field)
        try:
            return cls(tuple(row.delay_s for row in rows))
        except ValueError as error:
            raise ConfigurationError(f"{field}: {path}: no message arrives; valid: one or more that do") from error


@dataclass(frozen=True)
class Sample:
    """One recorded message of a trace."""

    sent_s: float | None
    """Time of sending on the recording's clock; None if unknown."""
    delay_s: float | None
    """Delay from sending to reception; None for a lost message."""


def read_samples(path: Path, field: str) -> list[Sample]:
    """Read the messages of a trace in order of sending, with send times. File and errors are those of `Trace.read`."""
    try:
        text = read_regular_file(path, _LARGEST_BYTES)
        if path.suffix == ".gz":
            text = gzip.decompress(text)
        lines = text.decode("utf-8-sig").splitlines()
    except (OSError, EOFError, ValueError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or "is no CSV"
        raise ConfigurationError(
            f"{field}: {str(path)!r} cannot be read: {reason}; valid: a CSV with {_COLUMNS}"
        ) from error
    if max(map(len, lines), default=0) > csv.field_size_limit():
        raise ConfigurationError(
            f"{field}: {str(path)!r} has a line of {max(map(len, lines))} characters; valid: a CSV"
        )
    table = csv.DictReader(lines)
    names = set(table.fieldnames or ())
    if not ("delay_ns" in names or {"sent_ns", "received_ns"} <= names):
        raise ConfigurationError(
            f"{field}: {path} has the columns {', '.join(sorted(map(str, names)))[:80] or 'none'}; valid: {_COLUMNS}"
        )
    rows: list[tuple[float, Sample]] = []
    for number, row in enumerate(itertools.islice(table, _MOST_ROWS + 1)):
        where = f"{field}: {path} row {number + 1}"
        if number == _MOST_ROWS:
            raise ConfigurationError(f"{where}: too many rows; valid: up to {_MOST_ROWS}")
        values = {
            name: _nanoseconds(row.get(name), name, where) for name in ("seq", "sent_ns", "received_ns", "delay_ns")
        }
        rows.append((_order(values, names, number, where), _sample(values, names, where)))
    rows.sort(key=lambda numbered: numbered[0])
    return _with_gaps(rows, path, field) if "seq" in names else [sample for _, sample in rows]


def _nanoseconds(text: str | None, name: str, where: str) -> float | None:
    if text is None or not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and abs(value) < 1e19):
        raise ConfigurationError(
            f"{where}: {name} = {text.strip()[:40]!r}; valid: a number, or nothing for a lost message"
        )
    return value


def _order(values: dict[str, float | None], names: set[str], number: int, where: str) -> float:
    for name in ("seq", "sent_ns"):
        if name in names:
            value = values[name]
            if value is None:
                raise ConfigurationError(f"{where}: {name} is empty; valid: a number")
            return value
    return float(number)


def _sample(values: dict[str, float | None], names: set[str], where: str) -> Sample:
    sent_ns, delay_ns = values["sent_ns"], values["delay_ns"]
    if "delay_ns" not in names and sent_ns is not None and values["received_ns"] is not None:
        delay_ns = values["received_ns"] - sent_ns
    if delay_ns is not None and delay_ns < 0.0:
        raise ConfigurationError(f"{where}: a delay of {delay_ns:.0f} ns; valid: 0 or more")
    return Sample(
        None if sent_ns is None else 1e-9 * sent_ns,
        None if delay_ns is None else 1e-9 * delay_ns,
    )


def _with_gaps(rows: Iterable[tuple[float, Sample]], path: Path, field: str) -> list[Sample]:
    """Return the samples of `rows` (sequence number, sample), with a lost message for each missing sequence number.

    Send times of lost messages are evenly between those of their neighbours.
    """
    samples: list[Sample] = []
    last: tuple[float, Sample] | None = None
    for sequence, sample in rows:
        if last is not None and sequence > last[0] + 1.0:
            missing = round(sequence - last[0]) - 1
            if len(samples) + missing > _MOST_ROWS:
                raise ConfigurationError(
                    f"{field}: {path}: seq jumps from {last[0]:.0f} to {sequence:.0f}; "
                    f"valid: up to {_MOST_ROWS} messages"
                )
            for position in range(1, missing + 1):
                sent_s = None
                if last[1].sent_s is not None and sample.sent_s is not None:
                    sent_s = last[1].sent_s + (sample.sent_s - last[1].sent_s) * position / (missing + 1)
                samples.append(Sample(sent_s, None))
        samples.append(sample)
        last = (sequence, sample)
    return samples
