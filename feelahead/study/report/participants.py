"""Statistics of one value a participant: intervals, an exact test, an effect size. Participants are the sample."""

from typing import Any

import numpy as np
from scipy.special import nctdtrinc
from scipy.stats import binomtest, bootstrap, norm, permutation_test, t, ttest_1samp

from common.arrays import FloatArray

_RESAMPLES = 9_999
_MOST_SIGNS = 2**16
"""Sign changes that are all tried, as for 16 participants; for more participants as many are drawn"""
_ALIKE = 1e-9
"""Difference that no outcome resolves: means of equal values differ by rounding alone"""


def are_alike(values: FloatArray) -> Any:
    """Return whether all values of the last axis are equal; what varies between participants is unknown then."""
    return np.ptp(values, axis=-1) <= _ALIKE


def alike_p(difference: Any, count: int) -> Any:
    """Return the exact test's p where all `count` differences are this one: two changes of sign are as far from 0."""
    return np.where(np.abs(difference) <= _ALIKE, 1.0, 2.0 ** (1 - count))


def mean_interval(values: FloatArray, seed: int) -> tuple[float, float] | None:
    """Return the 95 % interval of the mean by a bootstrap over participants; None for fewer than three, or all alike.

    Percentiles, widened for few participants: Hesterberg, What teachers should know about the bootstrap, The American
    Statistician 69, 2015. values: (participants,).
    """
    count = len(values)
    if count < 3 or are_alike(values):
        return None
    level = 1.0 - 2.0 * norm.cdf(-np.sqrt(count / (count - 1)) * t.ppf(0.975, count - 1))
    found = bootstrap(
        (values,),
        np.mean,
        n_resamples=_RESAMPLES,
        confidence_level=float(level),
        method="percentile",
        rng=np.random.default_rng(seed),
    ).confidence_interval
    return float(found.low), float(found.high)


def share_interval(shares: FloatArray, seed: int) -> tuple[float, float] | None:
    """Return the interval of a mean share in 0 to 1, or None, as `mean_interval`; where all have 0, or 1, an exact one.

    That one is Clopper's and Pearson's, each participant counting once: so 0 of 12 leaves up to 26 %.
    """
    if len(shares) >= 3 and are_alike(shares) and shares[0] in (0.0, 1.0):
        found = binomtest(int(shares.sum()), len(shares)).proportion_ci(0.95, method="exact")
        return float(found.low), float(found.high)
    if (interval := mean_interval(shares, seed)) is None:
        return None
    return max(0.0, interval[0]), min(1.0, interval[1])


def sign_change_p(differences: FloatArray, seed: int) -> float:
    """Return the two-sided p that each participant's difference could as well have the other sign.

    Exact up to 16 participants, or if all are alike; else by 65 536 drawn changes of sign.
    """
    moved = differences[np.abs(differences) > _ALIKE]
    if len(moved) < 2:
        return 1.0
    if are_alike(moved):
        return float(alike_p(moved[0], len(moved)))
    generator = np.random.default_rng(seed)
    found = permutation_test(
        (moved,), np.mean, permutation_type="samples", vectorized=True, n_resamples=_MOST_SIGNS, rng=generator
    )
    return float(found.pvalue)


def paired_t(differences: FloatArray) -> tuple[float, float, float] | None:
    """Return Student's p, and the ends of the 95 % interval of the mean; None for fewer than three, or all alike."""
    if len(differences) < 3 or are_alike(differences):
        return None
    found = ttest_1samp(differences, 0.0)
    interval = found.confidence_interval(0.95)
    return float(found.pvalue), float(interval.low), float(interval.high)


def cohens_d_z(differences: FloatArray) -> tuple[float, float, float] | None:
    """Return the mean difference over its standard deviation, and its 95 % interval by the noncentral t.

    None for fewer than three participants, or if all are alike.
    """
    count = len(differences)
    if count < 3 or are_alike(differences):
        return None
    effect = float(differences.mean() / differences.std(ddof=1))
    at = effect * np.sqrt(count)
    low, high = nctdtrinc(count - 1, [0.975, 0.025], at) / np.sqrt(count)
    return effect, float(low), float(high)
