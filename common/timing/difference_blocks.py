"""Clock differences of one direction of a link, summarised over blocks of time in bounded memory.

A clock difference is the receiver's stamp of a message minus the sender's: delay plus clock offset.
"""

import math
from collections import deque
from dataclasses import dataclass, replace

MOST_BLOCKS = 64
"""Maximum number of blocks kept of one direction."""
_LEAST_COUNT_FOR_SHAPE = 8
_LEAST_VARIANCE_FOR_SHAPE_S2 = 0.1e-3**2
"""Least variance, in s², with which a skewness is computed: below 0.1 ms the clocks' drift dominates the jitter."""


@dataclass(frozen=True, slots=True)
class Block:
    """Summary of the clock differences in a block of time; times are in seconds from the estimator's origin."""

    least_s: float
    """Least difference; `least_at_s` is its time."""
    least_at_s: float
    count: int
    """Number of fair samples (see BlockTrack.add), which the mean, squares, cubes and skewness describe."""
    mean_at_s: float
    mean_s: float
    squares_s2: float
    """Sum of the squared deviations from the mean."""
    cubes_s3: float
    """Sum of the cubed deviations from the mean."""
    skewness: float | None
    """Third standardised moment: 0 if symmetric, 2 for an exponential distribution. None for too few or too similar
    samples."""

    def merged(self, later: "Block") -> "Block":
        """Merge with `later` into one block.

        Moments are combined after Chan, Golub and LeVeque 1979, the third after Terriberry 2007.
        """
        least = self if self.least_s <= later.least_s else later
        if not self.count or not later.count:
            full = self if self.count else later
            return replace(full, least_s=least.least_s, least_at_s=least.least_at_s)
        count = self.count + later.count
        share = later.count / count
        apart_s = later.mean_s - self.mean_s
        across = apart_s * apart_s * self.count * share
        squares_s2 = self.squares_s2 + later.squares_s2 + across
        cubes_s3 = (
            self.cubes_s3
            + later.cubes_s3
            + across * apart_s * (self.count - later.count) / count
            + 3.0 * apart_s * (self.count * later.squares_s2 - later.count * self.squares_s2) / count
        )
        return Block(
            least.least_s,
            least.least_at_s,
            count,
            self.mean_at_s + share * (later.mean_at_s - self.mean_at_s),
            self.mean_s + share * apart_s,
            squares_s2,
            cubes_s3,
            _skewness(count, squares_s2, cubes_s3),
        )


def _skewness(count: int, squares_s2: float, cubes_s3: float) -> float | None:
    if count < _LEAST_COUNT_FOR_SHAPE:
        return None
    variance_s2 = squares_s2 / count
    if variance_s2 < _LEAST_VARIANCE_FOR_SHAPE_S2:
        return None
    return cubes_s3 / count / (variance_s2 * math.sqrt(variance_s2))


class BlockTrack:
    """Closed blocks of one direction, oldest first, and the open block to which samples are added."""

    def __init__(self) -> None:
        self.blocks: deque[Block] = deque()
        self._open()

    def _open(self) -> None:
        self._least_s = math.inf
        self._least_at_s = 0.0
        self._count = 0
        self._pivot_s = 0.0
        self._times_s = self._sum_s = self._squares_s2 = self._cubes_s3 = 0.0

    def add(self, at_s: float, difference_s: float, *, fair: bool = True) -> None:
        """Add one sample, of time `at_s`, to the open block.

        `fair` is False for a sample that was selected because it was early: it counts only for the least difference.
        """
        if difference_s < self._least_s:
            self._least_s, self._least_at_s = difference_s, at_s
        if fair:
            if not self._count:
                self._pivot_s = difference_s
            deviation_s = difference_s - self._pivot_s
            square_s2 = deviation_s * deviation_s
            self._count += 1
            self._times_s += at_s
            self._sum_s += deviation_s
            self._squares_s2 += square_s2
            self._cubes_s3 += square_s2 * deviation_s

    def close(self) -> Block | None:
        """Open a new block; return the previous one, or None if it was empty. `keep` adds it to `blocks`."""
        if self._least_s == math.inf:
            return None
        count = self._count
        mean_s = self._sum_s / count if count else 0.0
        squares_s2 = max(0.0, self._squares_s2 - mean_s * self._sum_s)
        cubes_s3 = self._cubes_s3 - 3.0 * mean_s * self._squares_s2 + 2.0 * mean_s * mean_s * self._sum_s
        block = Block(
            self._least_s,
            self._least_at_s,
            count,
            self._times_s / count if count else 0.0,
            self._pivot_s + mean_s,
            squares_s2,
            cubes_s3,
            _skewness(count, squares_s2, cubes_s3),
        )
        self._open()
        return block

    def keep(self, block: Block, oldest_s: float) -> None:
        """Append `block`; forget old blocks: those with the least sample before `oldest_s`, or beyond `MOST_BLOCKS`."""
        blocks = self.blocks
        blocks.append(block)
        while len(blocks) > MOST_BLOCKS or blocks[0].least_at_s < oldest_s:
            blocks.popleft()
            if not blocks:
                return

    def coarsen(self) -> None:
        """Merge the blocks two by two; the last of an odd number stays as it is."""
        blocks = list(self.blocks)
        merged = [one.merged(other) for one, other in zip(blocks[::2], blocks[1::2], strict=False)]
        self.blocks = deque(merged + blocks[2 * len(merged) :])
