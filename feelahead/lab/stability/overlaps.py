"""Overlaps under stress: all adversarial classes, as drawn, 1 000 km off, and in four scales."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.reference import errors
from feelahead.lab.reference.classes import MAKERS, family
from feelahead.lab.reference.oracle import true_overlaps
from feelahead.lab.reference.pairs import Pairs
from feelahead.lab.stability.tally import Part, Tally

_VOLUME, _RELATIVE = "of the sphere", "of the overlap, from 1e-12 of the sphere on"
_LIMIT: Final = 1e-15
"""Largest error of a volume and of an area, and half of that of a gradient, as `robot_side.overlap` promises"""
_RELATIVE_LIMIT: Final = 1e-9
_FAR: Final = "1 000 km off"
_OFF_M: Final = np.array((8e5, -5e5, 3.3e5))
_SCALES: Final = {f"scale {factor:g}": factor for factor in (1e-9, 1e-4, 1e4, 1e9)}


def check(group: str, count: int, rng: np.random.Generator) -> Iterator[Tally]:
    """Compare `count` pairs of each class, general and on the grid, with truths of 30 digits or more."""
    for solid, makers in MAKERS.items():
        tallies: dict[str, tuple[Tally, Tally]] = {}
        for name, make in makers.items():
            case, of = f"{solid}, {group}", family(name)
            volume, relative = tallies.setdefault(
                of, (Tally(case, _VOLUME, _LIMIT, of=of), Tally(case, _RELATIVE, _RELATIVE_LIMIT, of=of))
            )
            for grid in (False, True):
                pairs, where = varied(make(rng, count, grid), group), f"{name}, {'grid' if grid else 'general'}"
                with volume.tried(where):
                    _note(pairs, where, volume, relative)
        for both in tallies.values():
            yield from both


def _note(pairs: Pairs, where: str, volume: Tally, relative: Tally) -> None:
    found = errors.compare(pairs, true_overlaps(pairs), errors.kernel_overlaps(pairs))
    for k in range(len(pairs)):
        volume.note((found.volume[k], 0.5 * found.gradient[k], found.area[k]), where)
        relative.note(found.relative[k] if found.shares[k] >= errors.LEAST_SHARE else 0.0, where)


def varied(pairs: Pairs, group: str) -> Pairs:
    """Return the pairs 1 000 km off, in another scale, or as they are; rounding makes them other pairs of doubles."""
    if group == _FAR:
        return _moved(pairs, _OFF_M)
    return _scaled(pairs, _SCALES[group]) if group in _SCALES else pairs


def _moved(pairs: Pairs, by_m: FloatArray) -> Pairs:
    place, *rest = pairs.parameters
    if pairs.solid == "half-space":
        rest = [rest[0] + place @ by_m]
    else:
        place = place + by_m
    return Pairs(pairs.solid, pairs.centers + by_m, pairs.radii, (place, *rest))


def _scaled(pairs: Pairs, factor: float) -> Pairs:
    place, *rest = pairs.parameters
    lengths = [factor * one for one in rest]
    rest = [rest[0], lengths[1]] if pairs.solid == "box" else lengths
    if pairs.solid != "half-space":
        place = factor * place
    return Pairs(pairs.solid, factor * pairs.centers, factor * pairs.radii, (place, *rest))


PART: Final = Part(("as drawn", _FAR, *_SCALES), (40, 3), check)
