"""How netem draws a delay: mean + jitter × a standard shape, from uniform random numbers."""

import functools
from typing import Literal

import numpy as np
from scipy.special import ndtri

from common.arrays import FloatArray

Distribution = Literal["uniform", "normal"]

_TABLE_SIZE = 4096
_STEPS_PER_SIGMA = 8192
_LOWEST_ENTRY = -(2**15)


@functools.cache
def normal_table() -> FloatArray:
    """The standard normal distribution as netem sees it: (4096,) quantiles in ascending order, read-only.

    netem's tables hold 16-bit integers in steps of 1/8192 sigma: the normal one begins at the least of them,
    −4.0, and ends at +3.52. Entry k is the quantile of (4 k + 1/2) / 16384 at that resolution, which yields
    exactly that span.
    """
    probabilities = (4.0 * np.arange(_TABLE_SIZE) + 0.5) / (4.0 * _TABLE_SIZE)
    steps = np.maximum(np.rint(_STEPS_PER_SIGMA * ndtri(probabilities)), _LOWEST_ENTRY)
    table: FloatArray = steps / _STEPS_PER_SIGMA
    table.setflags(write=False)
    return table


def draw_delays(
    generator: np.random.Generator,
    count: int,
    mean_s: float,
    jitter_s: float,
    distribution: Distribution,
) -> FloatArray:
    """Draw (count,) independent delays in seconds.

    `uniform` is mean ± jitter, netem's shape where none is named; for `normal` the jitter is the standard
    deviation. What would be negative is 0: such a packet leaves at once.
    """
    if jitter_s == 0.0:
        return np.full(count, mean_s)
    if distribution == "uniform":
        delays_s = generator.uniform(mean_s - jitter_s, mean_s + jitter_s, count)
    else:
        table = normal_table()
        delays_s = mean_s + jitter_s * table[generator.integers(table.size, size=count)]
    return np.maximum(delays_s, 0.0)
