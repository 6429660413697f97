"""The overlap of one sphere with one object along a way, and where the strengths begin, in plain NumPy.

W(E) = max over 0 <= E' <= E of (V(E') - V(0))⁺,   d = sup{E >= 0 : W(E) = 0}
s(D) = min(1, W(D + m) / max(W(d + m), m |∇V(0)|, V_min))

V is worked out at nodes, m/6 apart where it rises and m/2 along a graze, and goes by cubics in between.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.ask import NODES_PER_MARGIN, NOTHING
from robot_side.ahead.tables import NODES, STRENGTHS

_PARTS: Final = 8
_NODES_FOR_MORE: Final = 30
_SHARES: Final = np.arange(_PARTS + 1) / _PARTS


@dataclass
class Ramp:
    """One sphere and one object."""

    center: FloatArray
    radius: float
    along: FloatArray
    overlaps: Sequence[Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]]
    """For each primitive of the object that it meets: V (k,) and gradients (k, 3) of spheres at (k, 3), radii (k,)"""
    entries: FloatArray
    """(p,) the ways at which it meets them"""
    least: float
    """V_min"""
    sooner_m: float
    """The ways to the object are shorter by this."""
    later_m: float
    """They are longer by this in slow zones where the object is to be touched."""
    touchable: bool
    nodes: list[tuple[float, float, float]] = field(default_factory=list)
    """Way, V and dV/dE"""

    def __post_init__(self) -> None:
        self.start = float(self.entries.min())
        self._free, self._floor, self._lean, self._rising = math.nan, 0.0, 0.0, 0.0
        self._disc = math.pi * self.radius**2
        self._nothing_m3 = NOTHING * 4.0 / 3.0 * math.pi * self.radius**3

    def ways(self, margin: float, reach: float) -> FloatArray:
        """The ways (8,) at which the strengths begin, infinite for those that are not reached."""
        found: FloatArray = np.full(STRENGTHS, math.inf)
        if self.start > 0.0:
            self._free, self.nodes = self.start, [(self.start, 0.0, 0.0)]
        elif not self._first() and not self._go_on(reach):
            return found
        while True:
            last = self.nodes[-1][0] if self.nodes else -math.inf
            if len(self.nodes) == NODES or last >= self._end(margin, reach):
                return found
            self._add(self._plan(margin, reach))
            if math.isnan(self._free) and not self._begins_to_rise():
                if not self._go_on(reach):
                    return found
                continue
            last, end = self.nodes[-1][0], self._end(margin, reach)
            if len(self.nodes) > 1 and (last >= end or last >= self._free + margin * (1.0 - 1e-9)):
                found = self._strengths(margin)
                entered, may_rise = self._to_come()
                if math.isfinite(found[-1]) or last >= end or (math.isinf(entered) and not may_rise):
                    return found

    def _first(self) -> bool:
        """V(0); whether it grows from there on."""
        self._add([0.0], first=True)
        _, self._floor, slope = self.nodes[0]
        if slope > NOTHING * self._disc:
            self._free = 0.0
        return not math.isnan(self._free)

    def _add(self, ways: Sequence[float], *, first: bool = False) -> None:
        """Work out V at these; of the last it is kept how much what still rises adds to its slope."""
        places = np.array(ways)
        volumes, slopes, push, rising = np.zeros(len(places)), np.zeros(len(places)), np.zeros(3), 0.0
        for overlap, entry in zip(self.overlaps, self.entries, strict=True):
            met = np.flatnonzero(places >= entry)
            if not met.size:
                continue
            own, gradients = overlap(self.center + places[met, None] * self.along, np.full(met.size, self.radius))
            volumes[met] += own
            slopes[met] += gradients @ self.along
            if met[-1] == len(places) - 1:
                rising += max(0.0, float(gradients[-1] @ self.along))
            if first:
                push += gradients[0]
                # What is touched at most may rise, for all that is known.
                rising = math.inf if own[0] <= self._nothing_m3 else rising
        if first:
            self._lean = float(np.linalg.norm(push))
        self._rising = rising
        self.nodes += zip(ways, volumes.tolist(), slopes.tolist(), strict=True)

    def _end(self, margin: float, reach: float) -> float:
        return reach if math.isnan(self._free) else max(reach, self._free + margin)

    def _plan(self, margin: float, reach: float) -> list[float]:
        """The ways of the next nodes."""
        planned = [] if self.nodes else [self.start]
        last = planned[0] if planned else self.nodes[-1][0]
        end = self._end(margin, reach)
        for _ in range(NODES_PER_MARGIN):
            count = len(self.nodes) + len(planned)
            if count < NODES and last < end:
                last += self._step(count, last, margin, end)
                planned.append(last)
        return planned

    def _step(self, count: int, last: float, margin: float, end: float) -> float:
        short, long = margin / NODES_PER_MARGIN, 0.5 * margin
        if math.isnan(self._free) or self._free + margin > last * (1.0 + 1e-9):
            return short
        if count > _NODES_FOR_MORE:
            return max(long, (end - last) / (NODES - count))
        near = (self.entries > max(self._free, last - margin)) & (self.entries < last + long)
        return short if near.any() else long

    def _pieces(self) -> tuple[FloatArray, FloatArray]:
        """Between nodes: ways (k, 9) and V (k, 9) at eighths; where V does not turn, it stays between its ends."""
        way, volume, slope = (np.array(column) for column in zip(*self.nodes, strict=True))
        step, rest = np.diff(way)[:, None], 1.0 - _SHARES
        turns = slope[:-1] * slope[1:] < 0.0
        cubic = (
            rest**2 * (1.0 + 2.0 * _SHARES) * volume[:-1, None]
            + _SHARES**2 * (3.0 - 2.0 * _SHARES) * volume[1:, None]
            + step * _SHARES * rest * (rest * slope[:-1, None] - _SHARES * slope[1:, None])
        )
        low, high = np.minimum(volume[:-1], volume[1:]), np.maximum(volume[:-1], volume[1:])
        within = np.clip(cubic, low[:, None], high[:, None])
        return way[:-1, None] + _SHARES * step, np.where(turns[:, None], cubic, within)

    def _begins_to_rise(self) -> bool:
        """Look for d; whether it is among the nodes."""
        before, excess = self.nodes[0][0], self.nodes[0][1] - self._floor
        if excess > self._nothing_m3:
            self._free = before
            return True
        if len(self.nodes) == 1:
            return False
        ways, volumes = self._pieces()
        for way, now in zip(ways[:, 1:].ravel(), volumes[:, 1:].ravel() - self._floor, strict=True):
            if now > self._nothing_m3:
                self._free = float(before + (way - before) * max(0.0, -excess) / (now - min(excess, 0.0)))
                return True
            before, excess = way, now
        return False

    def _to_come(self) -> tuple[float, bool]:
        """Find where the next primitive is entered, and whether V may rise before."""
        later = self.entries[self.entries > self.nodes[-1][0]]
        return float(later.min(initial=math.inf)), self._rising > NOTHING * self._disc

    def _go_on(self, reach: float) -> bool:
        """Begin again where V could begin to exceed V(0); whether that is within the reach."""
        entered, may_rise = self._to_come()
        if not may_rise:
            self.nodes, self.start = [], entered
            return entered < reach
        way, volume, slope = self.nodes[-1]
        # No overlap rises faster than by the sphere's disc.
        skipped = (self._floor - volume) / self._disc
        self.start = way + max(skipped, 0.0)
        self.nodes = [] if skipped > 0.0 else [(way, volume, slope)]
        return self.start < reach

    def _strengths(self, margin: float) -> FloatArray:
        """The ways (8,) at which strengths begin, by the nodes so far."""
        ways, volumes = self._pieces()
        risen = volumes - self._floor
        end = (self._free + margin) * (1.0 + 1e-12)
        top = max(0.0, float(risen[ways <= end].max(initial=0.0)))
        reference = max(top, margin * self._lean, self.least)
        beyond = (ways > self._free) & (np.arange(_PARTS + 1) > 0)
        way, strength = ways[beyond], np.maximum.accumulate(np.minimum(1.0, np.maximum(risen[beyond] / reference, 0.0)))
        way, strength = np.append(self._free, way), np.append(0.0, strength)
        found: FloatArray = np.full(STRENGTHS, math.inf)
        for level in range(STRENGTHS):
            due = (level + 0.5) / STRENGTHS
            if strength[-1] >= due:
                k = int(np.argmax(strength >= due))
                share = (due - strength[k - 1]) / (strength[k] - strength[k - 1])
                found[level] = way[k - 1] + share * (way[k] - way[k - 1]) - margin
        return found
