"""Random numbers of emulated links, correlated as the kernel's netem correlates them.

netem mixes each uniform number with the one before, x = (1 − r) U + r last. That narrows the distribution around
its middle, so that rare events all but vanish: `loss 10% 50%` loses 0.1 %.
"""

import itertools
from collections.abc import Iterator

import numpy as np

from common.arrays import FloatArray

DRAWN_AT_ONCE = 256
_WORDS = 2**32


def uniform_blocks(generator: np.random.Generator, correlation: float = 0.0) -> Iterator[FloatArray]:
    """Blocks of numbers in [0, 1), without end, each correlated with the one before by `correlation`."""
    while correlation == 0.0:
        yield generator.random(DRAWN_AT_ONCE)
    # The kernel's words: weights of 32 bits, and the sum cut to 32 bits.
    weight = round(correlation * (_WORDS - 1)) + 1
    last = int(generator.integers(_WORDS))
    while True:
        fresh = generator.integers(_WORDS, size=DRAWN_AT_ONCE).tolist()
        steps = itertools.accumulate(
            fresh, lambda before, new: (new * (_WORDS - weight) + before * weight) // _WORDS, initial=last
        )
        words = np.fromiter(steps, np.int64, DRAWN_AT_ONCE + 1)[1:]
        last = int(words[-1])
        yield words / _WORDS


def decisions(generator: np.random.Generator, share: float, correlation: float = 0.0) -> Iterator[bool]:
    """Say time after time whether an event of probability `share` happens."""
    for block in uniform_blocks(generator, correlation):
        yield from (block < share).tolist()
