"""Fits of a straight line to the clock differences of both directions: offset and skew of the peer's clock.

The clock difference of a message to the peer is delay + offset; of a message from the peer it is delay − offset. So
one direction bounds the offset from above, the other from below. The lower envelope assumes that the least delays of
both directions are equal; the mean assumes that the average delays are equal.
"""

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from common.timing.difference_blocks import Block

TYPICAL_SKEW = 50e-6
"""Prior standard deviation of the skew: quartz crystals have tolerances of 20 to 100 ppm."""
_LEAST_SCALE_S = 1e-6
_HALVINGS = 24

Point = tuple[float, float]
"""(time, clock difference), both in seconds."""


@dataclass(frozen=True, slots=True)
class OffsetLine:
    """Clock offset that is `offset_s` at the time `at_s` and changes by `skew` seconds a second."""

    at_s: float
    offset_s: float
    skew: float

    def value(self, at_s: float) -> float:
        """Return the offset at `at_s`."""
        return self.offset_s + self.skew * (at_s - self.at_s)


@dataclass(frozen=True, slots=True)
class Floor:
    """Line under one direction's clock differences; `scale_s` is the mean height of the blocks' least ones above it."""

    difference_s: float
    """Difference at time 0."""
    slope: float
    scale_s: float

    def excess(self, block: Block) -> float:
        """Return the height of a block's least difference above the line."""
        return block.least_s - self.difference_s - self.slope * block.least_at_s


@dataclass(frozen=True, slots=True)
class Envelope:
    """Line fitted to the least delays both ways."""

    line: OffsetLine
    to_peer: Floor
    from_peer: Floor


class _Hull:
    """Lower convex hull of points, with its supporting line for a given slope."""

    def __init__(self, points: Iterable[Point], slope: float) -> None:
        ordered = sorted(points)
        self.vertices = _lower_hull(ordered)
        self._slopes = [
            (right[1] - left[1]) / (right[0] - left[0])
            for left, right in zip(self.vertices, self.vertices[1:], strict=False)
        ]
        self.mean_at_s = sum(at_s for at_s, _ in ordered) / len(ordered)
        mean_s = sum(value_s for _, value_s in ordered) / len(ordered)
        at_s, value_s = self.lowest(slope)
        # Mean height of the points above the supporting line, and its weight in the likelihood, both of an exponential.
        self.scale_s = max(mean_s - value_s - slope * (self.mean_at_s - at_s), _LEAST_SCALE_S)
        self.firmness = len(ordered) / self.scale_s

    def lowest(self, slope: float) -> Point:
        """Return the vertex on the supporting line of `slope`."""
        return self.vertices[bisect_left(self._slopes, slope)]


def _lower_hull(ordered: Sequence[Point]) -> list[Point]:
    """Return the lower convex hull of points in ascending order (Andrew's monotone chain)."""
    hull: list[Point] = []
    for at_s, value_s in ordered:
        if hull and hull[-1][0] == at_s:  # ascending, hence not lower
            continue
        while len(hull) > 1:
            (first_at_s, first_s), (last_at_s, last_s) = hull[-2], hull[-1]
            if (last_s - first_s) * (at_s - first_at_s) < (value_s - first_s) * (last_at_s - first_at_s):
                break
            hull.pop()
        hull.append((at_s, value_s))
    return hull


def fit_envelope(to_peer: Sequence[Block], from_peer: Sequence[Block], max_skew: float, skew: float) -> Envelope:
    """Fit the likeliest offset line, if the least delays exceed a floor in each direction by exponential amounts.

    It is a supporting line of the convex hull (Moon, Skelly and Towsley 1999), here for both directions at once. The
    skew has a normal prior with the standard deviation `TYPICAL_SKEW`, and is within ± `max_skew`; `skew` is a first
    guess. Neither sequence may be empty.
    """
    upper = _Hull(((block.least_at_s, block.least_s) for block in to_peer), skew)
    lower = _Hull(((block.least_at_s, block.least_s) for block in from_peer), -skew)
    # The likelihood is concave in the skew: halve the interval in which its derivative changes sign.
    least, most = -max_skew, max_skew
    for _ in range(_HALVINGS):
        skew = (least + most) / 2.0
        rising = (
            upper.firmness * (upper.mean_at_s - upper.lowest(skew)[0])
            + lower.firmness * (lower.lowest(-skew)[0] - lower.mean_at_s)
            - skew / TYPICAL_SKEW**2
        )
        if rising > 0.0:
            least = skew
        else:
            most = skew
    at_s, value_s = upper.lowest(skew)
    to_floor = Floor(value_s - skew * at_s, skew, upper.scale_s)
    at_s, value_s = lower.lowest(-skew)
    from_floor = Floor(value_s + skew * at_s, -skew, lower.scale_s)
    return Envelope(
        OffsetLine(0.0, (to_floor.difference_s - from_floor.difference_s) / 2.0, skew), to_floor, from_floor
    )


class Average:
    """Averages over the blocks of one direction. There must be at least one block, and each count must be above 0."""

    def __init__(self, blocks: Sequence[Block]) -> None:
        self._blocks = blocks
        count = 0
        times_s = values_s = squares_s2 = 0.0
        for block in blocks:
            count += block.count
            times_s += block.count * block.mean_at_s
            values_s += block.count * block.mean_s
            squares_s2 += block.squares_s2
        self.at_s = times_s / count
        self.mean_s = values_s / count
        self.variance_s2 = max(squares_s2 / count, _LEAST_SCALE_S**2)
        """Variance of the samples about the means of their blocks."""
        self.spread_s2 = self.tilt_s2 = 0.0
        """Sums over the samples: of the squared time from `at_s`, and of that time times the difference from
        `mean_s`."""
        for block in blocks:
            weight_s = block.count * (block.mean_at_s - self.at_s)
            self.spread_s2 += weight_s * (block.mean_at_s - self.at_s)
            self.tilt_s2 += weight_s * (block.mean_s - self.mean_s)

    def wander(self, slope: float) -> float:
        """Return the median deviation of the blocks' means from a line of `slope`, in standard errors.

        Independent delays give 0.67. Much more means that delays vary more slowly than a block lasts, as by a queue.
        """
        strays = [
            abs(block.mean_s - self.mean_s - slope * (block.mean_at_s - self.at_s)) * math.sqrt(block.count)
            for block in self._blocks
        ]
        return median(strays) / math.sqrt(self.variance_s2)


def fit_mean(to_peer: Average, from_peer: Average, max_skew: float) -> OffsetLine:
    """Fit the least-squares line through the blocks' means. Prior and limits of the skew are as in `fit_envelope`."""
    information = to_peer.spread_s2 / to_peer.variance_s2 + from_peer.spread_s2 / from_peer.variance_s2
    tilt = to_peer.tilt_s2 / to_peer.variance_s2 - from_peer.tilt_s2 / from_peer.variance_s2
    skew = min(max(tilt / (information + TYPICAL_SKEW**-2), -max_skew), max_skew)
    return OffsetLine((to_peer.at_s + from_peer.at_s) / 2.0, (to_peer.mean_s - from_peer.mean_s) / 2.0, skew)


def typical_skewness(blocks: Iterable[Block], least_blocks: int) -> float | None:
    """Return the median skewness of the blocks, robust to single delays. None if fewer than `least_blocks` have one."""
    found = [block.skewness for block in blocks if block.skewness is not None]
    return median(found) if len(found) >= least_blocks else None
