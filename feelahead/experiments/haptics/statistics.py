"""Intervals and tests for pairs of trials: exact where there is a count, resampled pairs where there is a time."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binomtest

_RESAMPLES = 10_000


def exact_interval(count: int, of: int) -> tuple[float, float]:
    """The share's 95 % interval after Clopper and Pearson; ValueError for a count of none."""
    interval = binomtest(count, of).proportion_ci(0.95, method="exact")
    return float(interval.low), float(interval.high)


def mcnemar_p(before: Sequence[bool], after: Sequence[bool]) -> float:
    """The exact two-sided p that pairs change as often one way as the other (McNemar); 1 where none changes."""
    gained = sum(not one and other for one, other in zip(before, after, strict=True))
    lost = sum(one and not other for one, other in zip(before, after, strict=True))
    return float(binomtest(gained, gained + lost, 0.5).pvalue) if gained + lost else 1.0


def restricted(times_s: Sequence[float | None], limit_s: float) -> np.ndarray:
    """The times, those beyond the limit or missing at the limit: their mean is the restricted mean."""
    return np.array([limit_s if one is None else min(one, limit_s) for one in times_s])


def mean_difference_interval(before: np.ndarray, after: np.ndarray, seed: int = 0) -> tuple[float, float]:
    """The 95 % interval of the mean of after - before, by resampling the pairs; seeded."""
    differences = after - before
    rows = np.random.default_rng(seed).integers(0, differences.size, (_RESAMPLES, differences.size))
    low, high = np.quantile(differences[rows].mean(axis=1), [0.025, 0.975])
    return float(low), float(high)
