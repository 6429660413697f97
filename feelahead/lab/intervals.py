"""Confidence intervals (95 %) of shares and means, and McNemar's test, each by SciPy's method."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binomtest, bootstrap, ttest_1samp, ttest_ind

_RESAMPLES = 9_999


def share_interval(count: int, of: int) -> tuple[float, float]:
    """Return the exact interval (Clopper and Pearson) of the share `count` of `of`; ValueError if `of` is 0."""
    interval = binomtest(count, of).proportion_ci(0.95, method="exact")
    return float(interval.low), float(interval.high)


def mcnemar_p(before: Sequence[bool], after: Sequence[bool]) -> float:
    """Return the two-sided p of McNemar's exact test that changes in both directions are equally likely.

    before, after: outcomes of the same pairs under two conditions. 1 if no pair changes.
    """
    gained = sum(not one and other for one, other in zip(before, after, strict=True))
    lost = sum(one and not other for one, other in zip(before, after, strict=True))
    return float(binomtest(gained, gained + lost, 0.5).pvalue) if gained + lost else 1.0


def mean_interval(values: Sequence[float], seed: int = 0) -> tuple[float, float]:
    """Return the bootstrap's percentile interval of the mean, by `seed`; the value itself twice if all are equal."""
    sample = np.asarray(values, dtype=np.float64)
    if np.ptp(sample) == 0.0:
        return float(sample[0]), float(sample[0])
    found = bootstrap(
        (sample,), np.mean, n_resamples=_RESAMPLES, method="percentile", rng=np.random.default_rng(seed)
    ).confidence_interval
    return float(found.low), float(found.high)


def student_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Return Student's interval of the mean; None for fewer than two values."""
    if len(values) < 2:
        return None
    if np.ptp(values) == 0.0:
        return values[0], values[0]
    interval = ttest_1samp(values, 0.0).confidence_interval(0.95)
    return float(interval.low), float(interval.high)


def welch_interval(first: Sequence[float], second: Sequence[float]) -> tuple[float, float] | None:
    """Return Welch's interval of the second mean minus the first; None if either has fewer than two values."""
    if min(len(first), len(second)) < 2:
        return None
    if np.ptp(first) == np.ptp(second) == 0.0:
        return second[0] - first[0], second[0] - first[0]
    interval = ttest_ind(second, first, equal_var=False).confidence_interval(0.95)
    return float(interval.low), float(interval.high)
