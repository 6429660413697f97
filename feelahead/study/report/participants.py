"""Statistics of one value a participant: intervals, an exact test, an effect size. Participants are the sample."""

import numpy as np
from scipy.special import nctdtrinc
from scipy.stats import binomtest, bootstrap, norm, permutation_test, t, ttest_1samp

from common.arrays import FloatArray

_RESAMPLES = 9_999
_MOST_SIGNS = 2**16
"""Sign changes that are all tried, as for 16 participants; for more participants as many are drawn"""


def mean_interval(values: FloatArray, seed: int) -> tuple[float, float] | None:
    """Return the 95 % interval of the mean by a bootstrap over participants; None for fewer than three.

    Percentiles, widened for few participants: Hesterberg, What teachers should know about the bootstrap, The American
    Statistician 69, 2015. values: (participants,).
    """
    count = len(values)
    if count < 3:
        return None
    if np.ptp(values) == 0.0:
        return float(values[0]), float(values[0])
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
    """Return the interval of a mean share in 0 to 1; where all participants have 0, or 1, an exact one.

    That one is Clopper's and Pearson's, each participant counting once: so 0 of 12 leaves up to 26 %.
    """
    if len(shares) >= 3 and np.ptp(shares) == 0.0 and shares[0] in (0.0, 1.0):
        found = binomtest(int(shares.sum()), len(shares)).proportion_ci(0.95, method="exact")
        return float(found.low), float(found.high)
    if (interval := mean_interval(shares, seed)) is None:
        return None
    return max(0.0, interval[0]), min(1.0, interval[1])


def sign_change_p(differences: FloatArray, seed: int) -> float:
    """Return the two-sided p that each participant's difference could as well have the other sign.

    Exact up to 16 participants; above by 65 536 drawn changes of sign.
    """
    moved = differences[differences != 0.0]
    if len(moved) < 2:
        return 1.0
    generator = np.random.default_rng(seed)
    found = permutation_test(
        (moved,), np.mean, permutation_type="samples", vectorized=True, n_resamples=_MOST_SIGNS, rng=generator
    )
    return float(found.pvalue)


def paired_t(differences: FloatArray) -> tuple[float, float, float] | None:
    """Return Student's p, and the ends of the 95 % interval of the mean; None for fewer than three participants."""
    if len(differences) < 3:
        return None
    if np.ptp(differences) == 0.0:
        same = float(differences[0])
        return (1.0 if same == 0.0 else 0.0), same, same
    found = ttest_1samp(differences, 0.0)
    interval = found.confidence_interval(0.95)
    return float(found.pvalue), float(interval.low), float(interval.high)


def cohens_d_z(differences: FloatArray) -> tuple[float, float, float] | None:
    """Return the mean difference over its standard deviation, and its 95 % interval by the noncentral t.

    None for fewer than three participants, or if all differences are equal.
    """
    count = len(differences)
    if count < 3 or np.ptp(differences) == 0.0:
        return None
    effect = float(differences.mean() / differences.std(ddof=1))
    at = effect * np.sqrt(count)
    low, high = nctdtrinc(count - 1, [0.975, 0.025], at) / np.sqrt(count)
    return effect, float(low), float(high)
