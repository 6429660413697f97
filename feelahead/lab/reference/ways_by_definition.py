"""The ways of §4.2 straight from their definition: the overlaps on a fine grid of ways, and nothing clever."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.reference.plain_ways import primitives
from robot_side.objects.perceived import PerceivedObjects

STEP_M = 5e-5
_NOTHING = 1e-9


@dataclass(frozen=True)
class Definition:
    """The numbers that the ways are defined by."""

    objects: PerceivedObjects
    direction: FloatArray
    reach_m: float
    margin_m: float = 0.012
    least_depth_m: float = 0.0005

    def ways(
        self,
        centers_m: FloatArray,
        radii_m: FloatArray,
        inflated_m: FloatArray,
        slacks: Sequence[float] = (0.0,),
    ) -> FloatArray:
        """Find the eight ways (k, 8) of spheres (m,) that are inflated by `inflated_m` (m,); infinite beyond the reach.

        slacks (k,): each strength must be exceeded by this much, of 1.
        """
        ways = np.full((len(slacks), 8), np.inf)
        for center, radius, inflated in zip(centers_m, radii_m, inflated_m, strict=True):
            for thing in range(len(self.objects.names)):
                found, touching = self._pair(center, radius + inflated, thing, slacks)
                ways = np.minimum(ways, found)
                if touching:
                    bare, _ = self._pair(center, radius, thing, slacks)
                    ways = np.minimum(ways, bare - inflated)
        return np.where(ways <= self.reach_m, ways, np.inf)

    def _pair(self, center: FloatArray, radius: float, thing: int, slacks: Sequence[float]) -> tuple[FloatArray, bool]:
        """Find the ways of one sphere and one object, and whether they overlap at the start."""
        along = np.arange(0.0, self.reach_m + self.margin_m + STEP_M, STEP_M)
        overlap, leaning = overlap_of(center + along[:, None] * self.direction, radius, self.objects, thing)
        ways = np.full((len(slacks), 8), np.inf)
        grown = np.maximum.accumulate(np.maximum(overlap - overlap[0], 0.0))
        rises = grown > _NOTHING * overlap.max()
        if rises.any():
            free = max(int(np.argmax(rises)) - 1, 0)
            full = min(free + round(self.margin_m / STEP_M), len(along) - 1)
            least = min(np.pi * radius * self.least_depth_m**2, 0.5 * volume_of(self.objects, thing))
            strengths = grown / max(grown[full], self.margin_m * leaning, least)
            for row, slack in enumerate(slacks):
                for level in range(8):
                    there = strengths >= (level + 0.5) / 8 + slack
                    if there.any():
                        ways[row, level] = along[int(np.argmax(there))] - self.margin_m
        return ways, bool(overlap[0] > 0.0)


def overlap_of(path_m: FloatArray, radius_m: float, objects: PerceivedObjects, thing: int) -> tuple[FloatArray, float]:
    """Return V (k,) of a sphere at each point of `path_m` (k, 3) with the object `thing`, and |∇V| at the first."""
    total, push, radii = np.zeros(len(path_m)), np.zeros(3), np.full(len(path_m), radius_m)
    for part in primitives(objects):
        if part.thing == thing:
            volumes, gradients = part.overlap(path_m, radii)
            total, push = total + volumes, push + gradients[0]
    return total, float(np.linalg.norm(push))


def volume_of(objects: PerceivedObjects, thing: int) -> float:
    """Return V_J in m³."""
    return sum(part.volume_m3 for part in primitives(objects) if part.thing == thing)
