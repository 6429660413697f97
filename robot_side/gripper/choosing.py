"""Greedy set cover: choice of few spheres that together contain many points."""

import numpy as np
from scipy.sparse import csr_array, hstack, vstack
from scipy.spatial.distance import cdist

from common.arrays import BoolArray, FloatArray, IntArray

_ROWS_AT_A_TIME = 512


def containing(centers_m: FloatArray, radii_m: FloatArray, points_m: FloatArray) -> BoolArray:
    """Return (m, p): whether each sphere, of centres (m, 3) and radii (m,), contains each point (p, 3)."""
    # On one processor: a matrix product of three columns keeps all of them busy, and takes longer.
    inside: BoolArray = cdist(centers_m, points_m, "sqeuclidean") <= (radii_m**2)[:, None]
    return inside


def contained_points(centers_m: FloatArray, radii_m: FloatArray, points_m: FloatArray, images: FloatArray) -> csr_array:
    """Return (m, p), true if any image of a sphere contains the point; `images` (g, 3, 3) map the spheres' centres."""
    pieces = [(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))]
    for first in range(0, len(centers_m), _ROWS_AT_A_TIME):
        rows = slice(first, first + _ROWS_AT_A_TIME)
        inside = np.zeros((len(radii_m[rows]), len(points_m)), dtype=np.bool_)
        for image in images:
            inside |= containing(centers_m[rows] @ image.T, radii_m[rows], points_m)
        row, column = inside.nonzero()
        pieces.append((row + first, column))
    row, column = (np.concatenate(several) for several in zip(*pieces, strict=True))
    return csr_array((np.ones(len(row)), (row, column)), shape=(len(centers_m), len(points_m)))


def with_contained(
    known: csr_array | None, centers_m: FloatArray, radii_m: FloatArray, points_m: FloatArray, images: FloatArray
) -> csr_array:
    """Return `contained_points`. known: its result for the first spheres and points, which is not computed anew."""
    spheres, points = (0, 0) if known is None else known.shape
    of_new = contained_points(centers_m[spheres:], radii_m[spheres:], points_m, images)
    if known is None:
        return of_new
    beside = contained_points(centers_m[:spheres], radii_m[:spheres], points_m[points:], images)
    together: csr_array = vstack([hstack([known, beside]), of_new], format="csr")
    return together


def greedy_set_cover(inside: csr_array, costs: FloatArray) -> IntArray:
    """Choose rows of `inside` (m, p) that together cover every column that any row covers; `costs` (m,) of the rows.

    Each step takes the column that is hardest to cover, such as a corner: the one whose best row gains least. That best
    row is chosen. Thus the cover grows from corners and edges inwards, and leaves no slivers there. Redundant rows are
    removed at the end.
    """
    of_column = inside.T.tocsr()
    bearing = np.flatnonzero(np.diff(of_column.indptr))
    starts = of_column.indptr[bearing]
    sizes = np.diff(inside.indptr) / costs
    best = np.zeros(inside.shape[1])
    if len(bearing):
        best[bearing] = np.maximum.reduceat(sizes[of_column.indices], starts)
    # Columns covered only by small rows count more.
    weights = np.divide(1.0, best, out=np.zeros_like(best), where=best > 0.0)
    gains = inside @ weights
    left = best > 0.0
    chosen: list[int] = []
    while left.any():
        value = gains / costs
        potential = np.maximum.reduceat(value[of_column.indices], starts)
        potential[~left[bearing]] = np.inf
        column = int(bearing[potential.argmin()])
        rows = of_column.indices[of_column.indptr[column] : of_column.indptr[column + 1]]
        row = int(rows[value[rows].argmax()])
        chosen.append(row)
        columns = inside.indices[inside.indptr[row] : inside.indptr[row + 1]]
        new = columns[left[columns]]
        left[new] = False
        touched = of_column[new]
        gains -= np.bincount(touched.indices, np.repeat(weights[new], np.diff(touched.indptr)), minlength=len(gains))
    return without_redundant(inside, np.array(chosen, dtype=np.int64), costs)


def without_redundant(inside: csr_array, chosen: IntArray, costs: FloatArray) -> IntArray:
    """Return the rows of `chosen` without redundant rows; costly rows, and then small ones, are removed first."""
    times: FloatArray = np.asarray(inside[chosen].sum(axis=0), dtype=np.float64).ravel()
    sizes = np.diff(inside.indptr)
    kept = []
    for row in sorted(chosen.tolist(), key=lambda row: (-costs[row], sizes[row])):
        columns = inside.indices[inside.indptr[row] : inside.indptr[row + 1]]
        if (times[columns] > 1.5).all():
            times[columns] -= 1.0
        else:
            kept.append(row)
    return np.array(sorted(kept), dtype=np.int64)
