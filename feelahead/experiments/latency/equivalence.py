"""Whether two media agree: 95 % intervals over trials, and two one-sided tests against a margin.

Trials are what is independent, not messages: each gives one number, and intervals are Welch's, after Student's t, of
the difference of two samples with variances of their own.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Verdict = Literal["equivalent", "differs", "not enough trials to tell"]


@dataclass(frozen=True)
class Difference:
    """Of the second sample's mean and the first's; in the samples' unit."""

    mean: float
    low: float
    """Of the 95 % interval; -infinity and infinity below two trials on either side"""
    high: float
    margin: float

    @property
    def verdict(self) -> Verdict:
        """Equivalent where the whole interval lies within the margin, different where all of it lies beyond."""
        if -self.margin <= self.low and self.high <= self.margin:
            return "equivalent"
        return "differs" if self.low > self.margin or self.high < -self.margin else "not enough trials to tell"


def difference(first: Sequence[float], second: Sequence[float], margin: float) -> Difference:
    """`second` less `first`, a number for each trial; ValueError where there is none."""
    if not first or not second:
        raise ValueError(f"trials = {len(first)} and {len(second)}; valid: 1 or more")
    mean = float(np.mean(second) - np.mean(first))
    if min(len(first), len(second)) < 2:
        return Difference(mean, -math.inf, math.inf, margin)
    squares = [float(np.var(sample, ddof=1)) / len(sample) for sample in (first, second)]
    half = 0.0
    if (total := sum(squares)) > 0.0:
        spent = sum(square**2 / (len(sample) - 1) for square, sample in zip(squares, (first, second), strict=True))
        half = _student(total**2 / spent) * math.sqrt(total)
    return Difference(mean, mean - half, mean + half, margin)


def mean_half_width(values: Sequence[float]) -> float | None:
    """Half the 95 % interval of the mean of trials; None below two."""
    if len(values) < 2:
        return None
    return _student(len(values) - 1) * float(np.std(values, ddof=1)) / math.sqrt(len(values))


def _student(degrees: float) -> float:
    from scipy.special import stdtrit  # noqa: PLC0415  # slow to load

    return float(stdtrit(degrees, 0.975))
