"""netem's loss models: independent or correlated, four states, and Gilbert-Elliott."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from common.arrays import FloatArray
from common.emulation.randomness import DRAWN_AT_ONCE, decisions
from common.limits import Share, check_limits
from common.units import format_share


class LossModel(Protocol):
    """Which messages are lost, one decision for each message, whatever the time between them."""

    def losses(self, generator: np.random.Generator) -> Iterator[bool]:
        """Say of each message whether it is lost, without end."""
        ...

    def share(self) -> float:
        """The share lost in the long run; with netem's correlation, the one asked for."""
        ...

    def words(self) -> str:
        """In netem's grammar."""
        ...


@dataclass(frozen=True)
class RandomLoss:
    """`loss random`: each message with the same probability."""

    probability: Share
    correlation: Share = 0.0

    def __post_init__(self) -> None:
        check_limits(self)

    def losses(self, generator: np.random.Generator) -> Iterator[bool]:
        """Implement LossModel."""
        return decisions(generator, self.probability, self.correlation)

    def share(self) -> float:
        """Implement LossModel."""
        return self.probability

    def words(self) -> str:
        """Implement LossModel."""
        correlation = f" {format_share(self.correlation)}" if self.correlation else ""
        return f"loss {format_share(self.probability)}{correlation}"


@dataclass(frozen=True)
class StateLoss:
    """`loss state`: 1 good, 4 a single loss, 3 loss within a burst, 2 reception within a burst (tc-netem(8)).

    Each message takes a step, and is lost when that ends in state 3 or 4. From 4 the next step is to 1.
    """

    p13: Share
    p31: Share
    p32: Share = 0.0
    p23: Share = 1.0
    p14: Share = 0.0

    def __post_init__(self) -> None:
        check_limits(self)
        for one, other in (("p13", "p14"), ("p31", "p32")):
            total = getattr(self, one) + getattr(self, other)
            # Percentages that make 100 % need not do so to the last binary digit.
            if total > 1.0 + 1e-9:
                raise ValueError(f"{one} + {other} = {total:g}; valid: at most 1, as both leave the same state")

    def losses(self, generator: np.random.Generator) -> Iterator[bool]:
        """Implement LossModel."""
        state = 1
        while True:
            for number in generator.random(DRAWN_AT_ONCE).tolist():
                if state == 1:
                    state = 4 if number < self.p14 else 3 if number < self.p14 + self.p13 else 1
                elif state == 2:
                    state = 3 if number < self.p23 else 2
                elif state == 3:
                    state = 2 if number < self.p32 else 1 if number < self.p32 + self.p31 else 3
                else:
                    state = 1
                yield state >= 3

    def share(self) -> float:
        """Implement LossModel: the chain's long-run share of states 3 and 4."""
        steps = np.array(
            [
                [1.0 - self.p13 - self.p14, 0.0, self.p13, self.p14],
                [0.0, 1.0 - self.p23, self.p23, 0.0],
                [self.p31, self.p32, 1.0 - self.p31 - self.p32, 0.0],
                [1.0, 0.0, 0.0, 0.0],
            ]
        )
        return float(_long_run(steps)[2:].sum())

    def words(self) -> str:
        """Implement LossModel."""
        return f"loss state {_shares(self)}"


@dataclass(frozen=True)
class GilbertElliott:
    """`loss gemodel p r 1-h 1-k`: a good and a bad state, with a loss probability in each.

    Each message is lost by the state that the one before left behind, while it takes a step itself.
    """

    p: Share
    """From good to bad."""
    r: Share
    """From bad to good: without loss in the good state, bursts of 1 / r messages on average."""
    loss_bad: Share = 1.0
    """1-h."""
    loss_good: Share = 0.0
    """1-k."""

    def __post_init__(self) -> None:
        check_limits(self)

    def losses(self, generator: np.random.Generator) -> Iterator[bool]:
        """Implement LossModel."""
        bad = False
        while True:
            steps, losses = generator.random((2, DRAWN_AT_ONCE)).tolist()
            for step, loss in zip(steps, losses, strict=True):
                if bad:
                    bad = step >= self.r
                    yield loss < self.loss_bad
                else:
                    bad = step < self.p
                    yield loss < self.loss_good

    def share(self) -> float:
        """Implement LossModel: p / (p + r) of the time is bad."""
        good, bad = _long_run(np.array([[1.0 - self.p, self.p], [self.r, 1.0 - self.r]]))
        return float(good * self.loss_good + bad * self.loss_bad)

    def words(self) -> str:
        """Implement LossModel."""
        return f"loss gemodel {_shares(self)}"


def _shares(loss: StateLoss | GilbertElliott) -> str:
    """In order, without those at the end that have their defaults."""
    parts = list(fields(loss))
    while getattr(loss, parts[-1].name) == parts[-1].default:
        parts.pop()
    return " ".join(format_share(getattr(loss, part.name)) for part in parts)


def _long_run(steps: FloatArray) -> FloatArray:
    """Shares of time in each state of a Markov chain that starts in the first: (n,) from (n, n)."""
    # Half of the steps stand still, which changes no share but makes chains that alternate converge.
    lazy = (np.clip(steps, 0.0, 1.0) + np.eye(len(steps))) / 2.0
    for _ in range(64):
        lazy = lazy @ lazy
        lazy /= lazy.sum(axis=1, keepdims=True)
    shares: FloatArray = lazy[0]
    return shares if math.isfinite(float(shares.sum())) else np.eye(len(steps))[0]
