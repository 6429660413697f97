"""By how much ways are felt otherwise than by the finest setting: too late is above 0, too early below."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.felt.replay import WAYS, Replayed


@dataclass(frozen=True)
class Errors:
    """Of one kind of way of both triggers, in mm, over those ticks in which either setting feels something."""

    count: int
    mean_mm: float
    p95_mm: float
    """Of the size"""
    earliest_mm: float
    latest_mm: float


def errors(found: Replayed, finest: Replayed, kind: str) -> Errors:
    """kind: what WAYS has after the side; a way that is felt by one of both only counts up to the horizon."""
    columns = [place for place, name in enumerate(WAYS) if name.endswith(kind)]
    horizon = np.minimum(found.horizon_m, finest.horizon_m)[:, None]
    ours, theirs = (np.minimum(one.ways_m[:, columns], horizon) for one in (found, finest))
    apart_mm: FloatArray = 1e3 * (ours - theirs)[np.minimum(ours, theirs) < horizon]
    if not apart_mm.size:
        return Errors(0, 0.0, 0.0, 0.0, 0.0)
    return Errors(
        count=int(apart_mm.size),
        mean_mm=float(apart_mm.mean()),
        p95_mm=float(np.quantile(np.abs(apart_mm), 0.95)),
        earliest_mm=float(apart_mm.min()),
        latest_mm=float(apart_mm.max()),
    )
