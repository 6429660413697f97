"""Shares with intervals: the draws of one approach are no strangers to each other, so that approaches are resampled."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_RESAMPLED = 2000
_TAIL = 0.025
_LEAST_APPROACHES = 10
"""A bootstrap over fewer says nothing: two that agree would make an interval of no width."""


@dataclass(frozen=True)
class Share:
    """A share of draws, with its bootstrap interval of 95 % over the approaches."""

    value: float
    low: float
    high: float
    draws: int
    approaches: int

    def holds(self, probability: float) -> bool:
        """Whether the interval's lower end is at least P - 0.1 (1 - P), over 10 approaches or more."""
        return self.approaches >= _LEAST_APPROACHES and self.low >= probability - 0.1 * (1.0 - probability)


def share(hits: Sequence[int], draws: Sequence[int], seed: int = 0) -> Share | None:
    """The share of `draws` that are `hits`, each a count for one approach; None without a draw."""
    hit, drawn = np.asarray(hits, dtype=np.float64), np.asarray(draws, dtype=np.float64)
    hit, drawn = hit[drawn > 0], drawn[drawn > 0]
    if drawn.size == 0:
        return None
    chosen = np.random.default_rng([seed, 0xB007]).integers(0, drawn.size, (_RESAMPLED, drawn.size))
    shares = hit[chosen].sum(axis=1) / drawn[chosen].sum(axis=1)
    low, high = np.quantile(shares, [_TAIL, 1.0 - _TAIL])
    return Share(float(hit.sum() / drawn.sum()), float(low), float(high), int(drawn.sum()), int(drawn.size))


def draws_needed(probability: float) -> int:
    """n >= 10 / (1 - P): so many draws let ten failures be expected."""
    return int(np.ceil(10.0 / (1.0 - probability) - 1e-9))
