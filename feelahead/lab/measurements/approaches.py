"""Tables of approaches: where a finger of constant force stops, and how well its motion is predicted."""

from collections.abc import Iterator
from math import sqrt
from pathlib import Path
from statistics import fmean, median
from typing import Final

from feelahead.lab.approaches.prediction import COMPENSATIONS
from feelahead.lab.measurements.lines import Lines
from feelahead.lab.table import Table

_LAWS: Final = {
    "no haptics": ("none", "operator"),
    "swept": ("swept", "operator"),
    "swept, v t_d": ("swept", "robot"),
    "paper": ("paper", "robot"),
}
"""Law and compensation by the column's heading"""


def approach(runs: Table) -> Lines:
    """Yield a row for each scene and force, a column for each law: over the links, the gap or the contact's speed."""
    yield "scene", "force, N", *_LAWS
    for (model, force_n), those in runs.groups("model", "force_n"):
        yield Path(model).stem, f"{force_n:g}", *(_over_links(those, *of) for of in _LAWS.values())


def _over_links(runs: Table, law: str, compensation: str) -> str:
    mine = Table(row for row in runs.where(law=law) if law == "none" or row["compensation"] == compensation)
    ends = [_ends(of_link) for _, of_link in mine.groups("link")]
    return ends[0] if ends and len({*ends}) == 1 else " / ".join(ends)


def _ends(runs: Table) -> str:
    """Return the middle gap at the end, in mm, the middle speed of those that touch, and how many still moved."""
    gaps_mm, speeds_mm_s = runs.values("stops_at_mm"), runs.values("contact_speed_mm_s")
    parts = [f"{median(gaps_mm):.1f}"] if gaps_mm else []
    parts += [f"hits at {median(speeds_mm_s):.0f}" if not gaps_mm else f"{len(speeds_mm_s)} hit"] if speeds_mm_s else []
    undecided = sum(row["end"] == "undecided" for row in runs)
    return ", ".join(parts + ([f"{undecided} undecided"] if undecided else []))


def error(predictions: Table) -> Lines:
    """Yield a row for each link: of both predictions, the standard deviation and the worst pull's 99 % quantile."""
    yield "link", "loop age, ms", "v t_d (eq. 8), mm", "the operator's own commands, mm"
    for (link,), those in predictions.groups("link"):
        yield link or "none", f"{fmean(those.values('robot_loop_age_ms')):.0f}", *_missed(those)


def _missed(of_link: Table) -> Iterator[str]:
    for kind in reversed(COMPENSATIONS):
        spreads = Table(row for row in of_link if row[f"{kind}_sd_mm"] is not None)
        squares = [row[f"{kind}_mean_mm"] ** 2 + row[f"{kind}_sd_mm"] ** 2 for row in spreads]
        yield f"{sqrt(fmean(squares)):.1f}, {max(of_link.values(f'{kind}_p99_mm')):.1f}"
