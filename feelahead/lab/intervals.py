"""Intervals and tests of shares and means, each by SciPy's own method and at 95 %."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binomtest, bootstrap, ttest_1samp, ttest_ind

_RESAMPLES = 9_999


def share_interval(count: int, of: int) -> tuple[float, float]:
    """Return the exact interval of a share (Clopper and Pearson); ValueError for a share of nothing."""
    interval = binomtest(count, of).proportion_ci(0.95, method="exact")
    return float(interval.low), float(interval.high)


def mcnemar_p(before: Sequence[bool], after: Sequence[bool]) -> float:
    """Return McNemar's exact two-sided p: whether changes in both directions are equally likely. 1 without changes."""
    gained = sum(not one and other for one, other in zip(before, after, strict=True))
    lost = sum(one and not other for one, other in zip(before, after, strict=True))
    return float(binomtest(gained, gained + lost, 0.5).pvalue) if gained + lost else 1.0


def mean_interval(values: Sequence[float], seed: int = 0) -> tuple[float, float]:
    """Return the bootstrap's percentile interval of a mean, seeded; the value itself for equal values."""
    sample = np.asarray(values, dtype=np.float64)
    if np.ptp(sample) == 0.0:
        return float(sample[0]), float(sample[0])
    found = bootstrap(
        (sample,), np.mean, n_resamples=_RESAMPLES, method="percentile", rng=np.random.default_rng(seed)
    ).confidence_interval
    return float(found.low), float(found.high)


def student_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Return Student's interval of a mean; None below two values."""
    if len(values) < 2:
        return None
    if np.ptp(values) == 0.0:
        return values[0], values[0]
    interval = ttest_1samp(values, 0.0).confidence_interval(0.95)
    return float(interval.low), float(interval.high)


def welch_interval(first: Sequence[float], second: Sequence[float]) -> tuple[float, float] | None:
    """Return Welch's interval of the second mean less the first; None below two values on either side."""
    if min(len(first), len(second)) < 2:
        return None
    if np.ptp(first) == np.ptp(second) == 0.0:
        return second[0] - first[0], second[0] - first[0]
    interval = ttest_ind(second, first, equal_var=False).confidence_interval(0.95)
    return float(interval.low), float(interval.high)
