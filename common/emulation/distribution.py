"""Distributions of netem's random delays: mean + jitter × quantile of a standard shape, from a table or closed form.

netem's tables have quantiles as 16-bit integers, in steps of 1/8192 jitter, so that no delay is more than 4 jitters
from the mean. Our tables are computed from the distributions' definitions.
"""

import functools
from statistics import NormalDist
from typing import Literal

import numpy as np

from common.arrays import FloatArray

Distribution = Literal["uniform", "normal", "pareto", "paretonormal", "exponential"]

STEPS_PER_JITTER = 8192
TABLE_SIZE = 4096
"""Number of entries in a table of quantiles, one for each 1/4096 of probability."""
_LOWEST_ENTRY, _HIGHEST_ENTRY = -(2**15), 2**15 - 1
_PARETO_SHAPE = 3.0
_PARETO_MEAN = _PARETO_SHAPE / (_PARETO_SHAPE - 1.0)


@functools.cache
def table(shape: Distribution) -> FloatArray | None:
    """Return the quantiles of `shape` (n,) in units of the jitter, ascending, read-only; None for closed forms."""
    if shape == "normal":
        steps = _normal_steps()
    elif shape == "pareto":
        steps = _pareto_steps()
    elif shape == "paretonormal":
        # A quarter of the normal quantile and three quarters of the Pareto one, as NISTnet defined it; cut to
        # whole steps towards zero.
        steps = np.trunc((_normal_steps(lowest=-np.inf) + 3.0 * _pareto_steps()) / 4.0)
    else:
        return None
    quantiles: FloatArray = steps / STEPS_PER_JITTER
    quantiles.setflags(write=False)
    return quantiles


def _normal_steps(lowest: float = _LOWEST_ENTRY) -> FloatArray:
    """Return the normal distribution's table in whole steps of 1/8192 jitter, from −4.0 to +3.52 jitters.

    Entry k is the quantile at the probability (4 k + 1/2) / 16384.
    """
    probabilities = (4.0 * np.arange(TABLE_SIZE) + 0.5) / (4.0 * TABLE_SIZE)
    # SciPy's function would be loaded in a turn, for tenths of a second, when a page changes the link.
    values = np.array([*map(NormalDist().inv_cdf, probabilities.tolist())])
    steps: FloatArray = np.maximum(np.rint(STEPS_PER_JITTER * values), lowest)
    return steps


def _pareto_steps() -> FloatArray:
    """Return the Pareto distribution's table in whole steps of 1/8192 jitter.

    Shape 3, least value 1, minus the mean 3/2, divided by the variance 3/4: netem does not divide by the standard
    deviation. The entries reach from −0.67 to the limit of +4 jitters. Their mean is −0.033, their standard deviation
    0.820 jitters.
    """
    survival = 1.0 - np.arange(TABLE_SIZE) / TABLE_SIZE
    variance = _PARETO_SHAPE / ((_PARETO_SHAPE - 1.0) ** 2 * (_PARETO_SHAPE - 2.0))
    steps: FloatArray = np.rint(STEPS_PER_JITTER * (survival ** (-1.0 / _PARETO_SHAPE) - _PARETO_MEAN) / variance)
    return np.minimum(steps, _HIGHEST_ENTRY)


def delays_at(probabilities: FloatArray, mean_s: float, jitter_s: float, shape: Distribution) -> FloatArray:
    """Return the delays in seconds at `probabilities` (n,) in [0, 1).

    `uniform`: mean ± jitter, netem's default shape. `normal`, `pareto`, `paretonormal`: mean plus jitter × table
    entry. `exponential`, which netem lacks: least delay `mean_s` plus an exponential random time of mean `jitter_s`;
    so the mean is `mean_s + jitter_s`. Negative delays become 0.
    """
    quantiles = table(shape)
    if quantiles is not None:
        in_jitters = quantiles[(probabilities * quantiles.size).astype(np.intp)]
    elif shape == "uniform":
        in_jitters = 2.0 * probabilities - 1.0
    else:
        in_jitters = -np.log1p(-probabilities)
    return np.maximum(mean_s + jitter_s * in_jitters, 0.0)


def moments(mean_s: float, jitter_s: float, shape: Distribution) -> tuple[float, float, float]:
    """Return mean, standard deviation and greatest value of the delays, in seconds.

    They are exact for shapes with a table. Closed forms are evaluated at 200 000 probabilities. The greatest value of
    `exponential` is infinity.
    """
    quantiles = table(shape)
    if quantiles is None:
        quantiles = np.zeros(1) if jitter_s == 0.0 else None
    if quantiles is not None:
        delays_s = np.maximum(mean_s + jitter_s * quantiles, 0.0)
        return float(delays_s.mean()), float(delays_s.std()), float(delays_s.max())
    fine_s = delays_at((np.arange(200_000) + 0.5) / 200_000, mean_s, jitter_s, shape)
    return float(fine_s.mean()), float(fine_s.std()), mean_s + jitter_s if shape == "uniform" else float("inf")
