"""netem's loss models (random with correlation, and Gilbert-Elliott), and its correlated random numbers.

For the correlation r netem mixes a uniform random number U with the previous result: x = (1 − r) U + r last. That
narrows the distribution around its middle, so that rare events nearly vanish: `loss 10% 50%` loses 0.1 %.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from common.limits import Limited, Share

_DRAWN_AT_ONCE = 256
_WORDS = 2**32


def uniform_blocks(generator: np.random.Generator, correlation: float = 0.0) -> Iterator[FloatArray]:
    """Yield, without end, blocks of random numbers in [0, 1); `correlation` is between successive numbers."""
    while correlation == 0.0:
        yield generator.random(_DRAWN_AT_ONCE)
    # As in the kernel: weights of 32 bits, and the sum cut to 32 bits.
    weight = round(correlation * (_WORDS - 1)) + 1
    last = int(generator.integers(_WORDS))
    while True:
        fresh = generator.integers(_WORDS, size=_DRAWN_AT_ONCE).tolist()
        steps = itertools.accumulate(
            fresh, lambda before, new: (new * (_WORDS - weight) + before * weight) // _WORDS, initial=last
        )
        words = np.fromiter(steps, np.int64, _DRAWN_AT_ONCE + 1)[1:]
        last = int(words[-1])
        yield words / _WORDS


def decisions(generator: np.random.Generator, share: float, correlation: float = 0.0) -> Iterator[bool]:
    """Yield, without end, whether an event of probability `share` happens."""
    for block in uniform_blocks(generator, correlation):
        yield from (block < share).tolist()


@dataclass(frozen=True)
class RandomLoss(Limited):
    """`loss random`: each message is lost with the same probability."""

    probability: Share
    correlation: Share = 0.0

    def losses(self, generator: np.random.Generator) -> Iterator[bool]:
        """Yield for each message whether it is lost, whatever the time between messages."""
        return decisions(generator, self.probability, self.correlation)

    def share(self) -> float:
        """Return the requested probability of loss; with netem's correlation fewer messages are lost."""
        return self.probability


@dataclass(frozen=True)
class GilbertElliott(Limited):
    """`loss gemodel p r 1-h 1-k`: a good and a bad state, with a probability of loss in each.

    Each message may change the state; the state before that decides whether the message is lost.
    """

    p: Share
    """Probability that a message changes the state from good to bad."""
    r: Share
    """Probability that a message changes the state from bad to good. A bad state lasts 1 / r messages on average."""
    loss_bad: Share = 1.0
    """Probability of loss in the bad state (1-h)."""
    loss_good: Share = 0.0
    """Probability of loss in the good state (1-k)."""

    def losses(self, generator: np.random.Generator) -> Iterator[bool]:
        """Yield for each message whether it is lost, whatever the time between messages."""
        bad = False
        while True:
            steps, losses = generator.random((2, _DRAWN_AT_ONCE)).tolist()
            for step, loss in zip(steps, losses, strict=True):
                if bad:
                    bad = step >= self.r
                    yield loss < self.loss_bad
                else:
                    bad = step < self.p
                    yield loss < self.loss_good

    def share(self) -> float:
        """Return the long-run share of lost messages, as the bad state's share of the time is p / (p + r)."""
        bad = self.p / (self.p + self.r) if self.p else 0.0
        return (1.0 - bad) * self.loss_good + bad * self.loss_bad


LossModel = RandomLoss | GilbertElliott
