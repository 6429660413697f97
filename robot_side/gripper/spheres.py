"""Cover of a gripper's boxes by spheres, which are enlarged and overlapped with the objects (§4.1).

Every sphere's centre is in its box. The radius is the centre's depth below the nearest face plus the distance by which
spheres may protrude. Such a sphere covers a disc of each face that it reaches. From the edges inwards, each frame of
spheres covers a band of every face: one sphere near each corner of the box, and rows along the edges between these.
Deeper frames have larger spheres. When a frame is as deep as half the box, one layer of spheres in the middle covers
the rest; each of its spheres reaches both sides. A thin box has only that layer.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray

_MOST_SPHERES_OF_A_BOX = 2000
# Share of the allowed protrusion that a plan leaves unused, far above rounding, so that no corner is just outside.
_MARGIN = 1e-6
_FRACTIONS = tuple(0.40 + 0.04 * step for step in range(15))
_CELL_M = 0.02
_SPECK_M = 0.001


@dataclass(frozen=True)
class SphereCover:
    """Spheres whose union contains the surfaces of the boxes.

    The inside of a thick box may be empty: whatever comes from outside meets a sphere at the surface first.
    """

    centers_m: FloatArray
    """(m, 3) centres of the spheres, in the frame in which the boxes are given"""
    radii_m: FloatArray
    """(m,) radii of the spheres"""
    box: IntArray
    """(m,) index of each sphere's box, ascending"""
    stand_out_m: FloatArray
    """(k,) distance by which the spheres protrude from each box: as given, or more for a very large box"""


class _Lattice(NamedTuple):
    """Evenly spaced centres, from minus to plus a span along each axis; a count of 1 means only the middle."""

    spans_m: tuple[float, ...]
    counts: tuple[int, ...]


def cover_boxes(
    centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray, stand_out_m: float = 0.003
) -> SphereCover:
    """Cover the surface of oriented boxes with spheres that protrude by at most `stand_out_m`.

    centers_m (k, 3), rotations (k, 3, 3) box to frame, half_sizes_m (k, 3); a half size may be 0. The spheres of a box
    are mirror-symmetric in its three middle planes, and in a fixed order. If a box would need more than 2000 spheres,
    they protrude by the least distance for which at most 2000 are needed.
    """
    covers = [_cover_box(tuple(half_sizes.tolist()), float(stand_out_m)) for half_sizes in half_sizes_m]
    box = np.repeat(np.arange(len(covers)), [len(radii) for _, radii, _ in covers])
    offsets = np.concatenate([offsets for offsets, _, _ in covers])
    return SphereCover(
        centers_m=centers_m[box] + np.einsum("mij,mj->mi", rotations[box], offsets),
        radii_m=np.concatenate([radii for _, radii, _ in covers]),
        box=box,
        stand_out_m=np.array([stand_out for _, _, stand_out in covers]),
    )


@lru_cache(maxsize=256)
def _cover_box(half_sizes_m: tuple[float, ...], stand_out_m: float) -> tuple[FloatArray, FloatArray, float]:
    """Return one box's spheres: centres (m, 3) in its frame, radii (m,), and the distance by which they protrude."""
    axes = sorted(range(3), key=lambda axis: half_sizes_m[axis])
    ascending = tuple(half_sizes_m[axis] for axis in axes)
    plan = _fewest(ascending, stand_out_m)
    if not plan:
        enough = too_little = stand_out_m
        while not plan:
            too_little, enough = enough, 2.0 * enough
            plan = _fewest(ascending, enough)
        for _ in range(20):
            middle = 0.5 * (too_little + enough)
            closer = _fewest(ascending, middle)
            enough, plan, too_little = (middle, closer, too_little) if closer else (enough, plan, middle)
        stand_out_m = enough

    centers = np.empty((sum(math.prod(lattice.counts) for lattice in plan), 3))
    centers[:, axes] = [
        center
        for spans, counts in plan
        for center in product(*(_spread(span, count) for span, count in zip(spans, counts, strict=True)))
    ]
    radii = (np.array(half_sizes_m) - np.abs(centers)).min(axis=1) + stand_out_m
    return centers, radii, stand_out_m


def _spread(span_m: float, count: int) -> list[float]:
    """Return `count` positions from minus to plus the span, exactly symmetric about 0."""
    return [span_m * ((2 * place - count + 1) / (count - 1)) for place in range(count)] if count > 1 else [0.0]


def _fewest(half_sizes_m: tuple[float, ...], stand_out_m: float) -> list[_Lattice]:
    """Return the frames and the layer with the fewest spheres; half sizes ascend. Return none if 2000 are too few."""
    usable_m = stand_out_m * (1.0 - _MARGIN)
    fewest, best = _MOST_SPHERES_OF_A_BOX + 1, list[_Lattice]()
    for at_edges, deeper in product(_FRACTIONS, _FRACTIONS):
        plan, count, done_m = list[_Lattice](), 0, 0.0
        while count < fewest and _corner_depth(done_m, usable_m) < half_sizes_m[0]:
            frame, done_m = _frame(half_sizes_m, done_m, deeper if plan else at_edges, usable_m)
            plan += frame
            count += sum(math.prod(lattice.counts) for lattice in frame)
        if count < fewest and (not plan or done_m < half_sizes_m[1]):
            plan.append(_layer(half_sizes_m, done_m, usable_m))
            count += math.prod(plan[-1].counts)
        if count < fewest:
            fewest, best = count, plan
    return best


def _corner_depth(done_m: float, stand_out_m: float) -> float:
    """Return the greatest depth below three faces at which a sphere's discs reach the corners of the uncovered rest.

    At depth t the discs' radius is √(2 t stand_out + stand_out²). With a band of width `done` covered along every edge,
    the corner of a face's uncovered rest is √2 (t - done) from the disc's centre. With done = 0 it is the box's corner.
    """
    return done_m + 0.5 * stand_out_m + 0.5 * math.sqrt(4.0 * done_m * stand_out_m + 3.0 * stand_out_m**2)


def _frame(
    half_sizes_m: tuple[float, ...], done_m: float, fraction: float, stand_out_m: float
) -> tuple[list[_Lattice], float]:
    """Return spheres that widen the covered band along every edge of every face, and the band's new width.

    The discs of the deepest possible row just touch the covered band. fraction: the row's depth beyond `done`, as a
    share of the deepest row's.
    """
    corner = _corner_depth(done_m, stand_out_m)
    # The corner's sphere covers a square of every face, from `done` to here.
    corner_end = 2.0 * corner - done_m
    way = stand_out_m + math.sqrt(2.0 * done_m * stand_out_m + 2.0 * stand_out_m**2)
    # In the middle of the box a row also serves the opposite edge.
    depth = min(done_m + fraction * way, half_sizes_m[0])
    half_step = math.sqrt(2.0 * depth * stand_out_m + stand_out_m**2 - (depth - done_m) ** 2)
    lattices = [_Lattice(tuple(half - corner for half in half_sizes_m), (2, 2, 2))]
    for axis, half in enumerate(half_sizes_m):
        if half > corner_end:
            spans = [other - depth for other in half_sizes_m]
            counts = [2 if span > 0.0 else 1 for span in spans]
            counts[axis] = math.ceil((half - corner_end) / half_step)
            spans[axis] = (half - corner_end) * (1.0 - 1.0 / counts[axis])
            lattices.append(_Lattice(tuple(spans), tuple(counts)))
    return lattices, 2.0 * depth - done_m


def _layer(half_sizes_m: tuple[float, ...], done_m: float, stand_out_m: float) -> _Lattice:
    """Return spheres in the middle of the shortest axis that cover everything farther than `done` from the edges.

    The spheres form a rectangular lattice; their discs on both large faces contain the lattice's cells. The outermost
    spheres are near enough to the narrow faces to contain a strip that the frames left there.
    """
    thin, *sides = half_sizes_m
    radius, strip = thin + stand_out_m, max(thin - done_m, 0.0)
    disc = math.sqrt(2.0 * thin * stand_out_m + stand_out_m**2)
    longest = math.sqrt(disc**2 - strip**2)
    fewest = _Lattice((0.0, 0.0, 0.0), (1, 2**31, 2**31))
    for fraction in _FRACTIONS:
        first = (sides[0] - done_m) / max(math.ceil((sides[0] - done_m) / (fraction * longest)), 1)
        first = max(first, strip)
        cell = (first, max(math.sqrt(disc**2 - first**2), strip))
        spans, counts = [0.0], [1]
        for side, half, other in zip(sides, cell, reversed(cell), strict=True):
            inset = done_m + half
            if strip > 0.0:
                inset = min(inset, math.sqrt(radius**2 - strip**2 - other**2))
            spans.append(max(side - inset, 0.0))
            counts.append(math.ceil(spans[-1] / half - 1e-9) + 1 if spans[-1] > 0.0 else 1)
        if math.prod(counts) < math.prod(fewest.counts):
            fewest = _Lattice(tuple(spans), tuple(counts))
    return fewest


def cells_cover(
    centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return a sphere around each cell of boxes (n,), without a search: centres (m, 3) and radii (m,).

    Cells are at most 20 mm wide; specks within other boxes are left out. A box's spheres stand out from it by up to
    7 mm.
    """
    centers, radii = [np.empty((0, 3))], [np.empty(0)]
    for center_m, rotation, half_m in zip(centers_m, rotations, half_sizes_m, strict=True):
        if half_m.max() > _SPECK_M:
            count = np.maximum(np.ceil(2.0 * half_m / _CELL_M), 1.0).astype(int)
            axes = [half * (2.0 * np.arange(n) + 1.0 - n) / n for half, n in zip(half_m, count, strict=True)]
            places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            centers.append(center_m + places @ rotation.T)
            radii.append(np.full(len(places), float(np.linalg.norm(half_m / count))))
    return np.concatenate(centers), np.concatenate(radii)
