"""Tables of a study: what came out under each condition, and its planned contrasts."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from feelahead.lab.measurements.lines import Lines
from feelahead.lab.table import Row, Table

_COPIED: Final = {"cells": "study", "contrasts": "contrasts"}


def outcomes(cells: Table) -> Lines:
    """Yield a row for each condition; entries of the delays are separated by a slash."""
    delays_ms = sorted(set(cells.values("delay_ms")))
    said = f"{' / '.join(f'{delay_ms:g}' for delay_ms in delays_ms)} ms"
    yield "condition", "trials with a hit", f"completed, %: {said}", f"time, s (mean): {said}"

    for (condition,), those in cells.groups("condition"):
        hits, completed, times_s = (
            [row for delay_ms in delays_ms for row in those.where(outcome=outcome, delay_ms=delay_ms)]
            for outcome in ("hit", "completed", "time_s")
        )
        yield (
            condition,
            f"{sum(row['value'] * row['trials'] for row in hits):.0f} of {sum(row['trials'] for row in hits):g}",
            " / ".join(f"{100 * row['value']:.0f}" for row in completed),
            " / ".join(f"{row['value']:.1f}" for row in times_s),
        )


def contrasts(planned: Table) -> Lines:
    """Yield a row for each planned contrast."""
    yield "planned contrast", "effect [95 %]", "p after Holm", "exact p"
    for row in planned:
        said, unit = _effect(row)
        effect, *ends = (said(row[name]) for name in ("effect", "low", "high"))
        p = [f"{row[name]:.2g}" if row[name] >= 0.001 else "< 0.001" for name in ("p_holm", "p_exact")]
        yield f"{row['outcome']}, {row['first']} / {row['second']}", f"{effect}{unit} [{', '.join(ends)}]", *p


def _effect(row: Row) -> tuple[Callable[[float], str], str]:
    """Return how an effect is written, and its unit."""
    if row["measure"] != "difference":
        return "{:.2f}".format, " times"
    return (lambda share: f"{100 * share:+.1f}", " points") if row["outcome"] == "hit" else ("{:+.0f}".format, " N s")


def copy(study: Path, figures: Path) -> None:
    """Write the outcomes and contrasts of a study's folder as CSV files."""
    from pyarrow import parquet  # noqa: PLC0415  # of the extra study

    for name, to in _COPIED.items():
        Table(parquet.read_table(study / f"{name}.parquet").to_pylist()).write_csv(figures / f"{to}.csv")
