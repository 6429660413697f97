"""Points of run time against error, the pooling of several cells' points, and the front that they form."""

from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.table import Row, Table

KEY: Final = ("part", "knob", "setting", "unit", "reference", "ours", "built")
"""Columns by which points of several cells (scenes, solids) are the same point"""


class Part(NamedTuple):
    """What the points of one front measure."""

    part: str
    unit: str
    """Unit of the errors"""
    reference: str
    """What counts as right"""


def point(
    of: Part, knob: str, setting: str, us: float, errors: FloatArray, *, ours: bool = True, built: bool = False
) -> Row:
    """Return the row of one point: processor time in µs, largest error (n,) and 95 % quantile.

    ours: whether this is part of feelahead, not a peer. built: whether feelahead is set so unless told otherwise.
    """
    sizes = np.abs(np.asarray(errors, dtype=float))
    found = {"us": us, "worst": float(sizes.max()), "p95": float(np.quantile(sizes, 0.95)), "cases": sizes.size}
    return of._asdict() | {"knob": knob, "setting": setting, "ours": ours, "built": built} | found


def pooled(table: Table) -> list[Row]:
    """Pool the points of all cells and seeds: median time, largest of the largest errors and of their quantiles.

    Rows of what is `missing` are left out. Each point gets the columns `beaten_by`, see there, and `of_built`: its time
    divided by that of the built-in setting of its part; None if there is none.
    """
    rows = []
    for key, same in Table(row for row in table if "missing" not in row).groups(*KEY):
        figures = {"us": float(np.median(same.values("us"))), "cases": sum(same.values("cases"))}
        worst = {name: max(same.values(name)) for name in ("worst", "p95")}
        rows.append(dict(zip(KEY, key, strict=True)) | figures | worst)
    for row in rows:
        built = [one["us"] for one in rows if one["built"] and _comparable(one, row)]
        row |= {"of_built": row["us"] / built[0] if built else None, "beaten_by": beaten_by(row, rows)}
    return rows


def beaten_by(row: Row, rows: Iterable[Row]) -> str | None:
    """Return the setting of the fastest point that is faster and more accurate; None for a point on the front.

    Points of the same part and unit are compared, by their largest errors.
    """
    better = [one for one in rows if _comparable(one, row) and one["us"] < row["us"] and one["worst"] < row["worst"]]
    if not better:
        return None
    fastest = min(better, key=lambda one: float(one["us"]))
    return str(fastest["setting"] if fastest["ours"] else f"{fastest['knob']}, {fastest['setting']}")


def _comparable(one: Row, other: Row) -> bool:
    return bool(one["part"] == other["part"] and one["unit"] == other["unit"])


def each(works: Sequence[Callable[[], object]]) -> Callable[[], None]:
    """Return a function that does all works."""

    def do() -> None:
        for work in works:
            work()

    return do
