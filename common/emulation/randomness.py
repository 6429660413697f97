"""Random numbers of emulated links: netem's correlated ones as they are, and properly correlated ones.

netem mixes each uniform number with the one before, x = (1 − r) U + r last. That narrows the distribution around
its middle, so that rare events all but vanish (`loss 10% 50%` loses 0.1 %), and a delay's correlation drowns in
the remainder by which it picks a table's entry. "netem" does the same. "proper" keeps the distribution: a Gaussian
autoregression of order 1 with coefficient r, mapped to uniform numbers by the normal distribution (a copula).
"""

import itertools
import math
from collections.abc import Iterator
from typing import Literal

import numpy as np

from common.arrays import FloatArray

CorrelationModel = Literal["netem", "proper"]

DRAWN_AT_ONCE = 256
_WORDS = 2**32


def uniform_blocks(
    generator: np.random.Generator, correlation: float, model: CorrelationModel, cells: int | None = None
) -> Iterator[FloatArray]:
    """Blocks of numbers in [0, 1), without end, each correlated with the one before by `correlation`.

    With `cells`, they serve to pick one of so many: netem takes its random word's remainder.
    """
    if correlation == 0.0:
        while True:
            yield generator.random(DRAWN_AT_ONCE)
    if model == "proper":
        yield from _autoregressive_blocks(generator, correlation)
    for words in _netem_blocks(generator, correlation):
        if cells is None:
            yield words / _WORDS
        else:
            yield (words % cells + 0.5) / cells


def decisions(
    generator: np.random.Generator, share: float, correlation: float, model: CorrelationModel
) -> Iterator[bool]:
    """Whether an event of probability `share` happens, time after time."""
    for block in uniform_blocks(generator, correlation, model):
        yield from (block < share).tolist()


def _autoregressive_blocks(generator: np.random.Generator, correlation: float) -> Iterator[FloatArray]:
    from scipy.special import ndtr  # noqa: PLC0415  # slow to load, and most runs emulate no such link

    innovation_sd = math.sqrt(1.0 - correlation**2)
    last = float(generator.standard_normal())
    while True:
        innovations = (innovation_sd * generator.standard_normal(DRAWN_AT_ONCE)).tolist()
        steps = itertools.accumulate(innovations, lambda before, new: correlation * before + new, initial=last)
        normals = np.fromiter(steps, np.float64, DRAWN_AT_ONCE + 1)[1:]
        last = float(normals[-1])
        # 1 − 2⁻⁵³ at most: a probability of 1 has no quantile.
        yield np.minimum(ndtr(normals), 1.0 - 2.0**-53)


def _netem_blocks(generator: np.random.Generator, correlation: float) -> Iterator[np.ndarray]:
    """The kernel's words: weights of 32 bits, and the sum cut to 32 bits."""
    weight = round(correlation * (_WORDS - 1)) + 1
    last = int(generator.integers(_WORDS))
    while True:
        fresh = generator.integers(_WORDS, size=DRAWN_AT_ONCE).tolist()
        steps = itertools.accumulate(
            fresh, lambda before, new: (new * (_WORDS - weight) + before * weight) // _WORDS, initial=last
        )
        words = np.fromiter(steps, np.int64, DRAWN_AT_ONCE + 1)[1:]
        last = int(words[-1])
        yield words
