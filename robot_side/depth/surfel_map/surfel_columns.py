"""Table of surfels: small pieces of surface, one a cell."""

from enum import IntEnum
from typing import Final, NamedTuple

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import INDICES, NUMBERS, Declared, rows

SUMS: Final = 15
"""Sums of the pixels on one surfel: count, offsets from the region's corner (3), their products (6), normals (3),
the least depth, and the picture's number"""


class SurfelColumns(NamedTuple):
    """Arrays with a row for each surfel; rows without a cell are free."""

    points_m: FloatArray
    """(n, 3) mean of its pixels' points"""
    normals: FloatArray
    """(n, 3) mean of its pixels' normals, not of unit length"""
    spreads_m2: FloatArray
    """(n, 6) covariance of its pixels' points: xx, yy, zz, xy, xz, yz"""
    looked_m: FloatArray
    """(n, 4) its point when surfaces were last looked for, and its standard deviation then"""
    noise_m2: FloatArray
    """(n,) variance that noise adds along a view"""
    weights: FloatArray
    """(n,) number of pictures of today's errors that its mean is worth"""
    sds_m: FloatArray
    """(n,) least standard deviation of its pixels"""
    unanswered_s: FloatArray
    """(n,) time for which it was in view without an answer"""
    cells: IntArray
    """(n,) its cell; -1: free"""
    evidence: IntArray
    """(n,) pictures for it, less those against it"""
    astray: IntArray
    """(n,) successive pictures that put it elsewhere"""
    roles: IntArray
    """(n,) index in ROLES; -1: none"""
    pointed: IntArray
    """(n,) 1 if an operator gave it its role, which labels do not change"""
    seen: IntArray
    """(n,) number of the last picture that shows it"""
    shown: IntArray
    """(n,) 1 from its second picture on"""
    sums: FloatArray
    """(n, 15) see `SUMS`"""
    votes: IntArray
    """(n,) majority vote on the role of one picture's pixels: lead of the candidate"""
    candidates: IntArray
    """(n,) candidate of the vote"""
    free: IntArray
    """(n,) rows that were used and are free again"""
    touched: IntArray
    """(n,) rows with pixels of the newest picture"""


SURFELS: Final = Declared(
    SurfelColumns,
    *(rows(3), rows(3), rows(6), rows(4)),
    *(NUMBERS,) * 4,
    *(INDICES,) * 7,
    rows(SUMS),
    *(INDICES,) * 4,
)

surfels_at: Final = SURFELS.at


class Count(IntEnum):
    """Counts of a table, as indices."""

    TOP = 0
    """Rows that were ever used"""
    FREE = 1
    TOUCHED = 2
    PICTURE = 3
    """Number of the newest picture"""
    MADE = 4
    CONTRADICTED = 5
    UNANSWERED = 6
    FULL = 7
    """Pixels that found no free row"""


def surfel_columns(count: int) -> SurfelColumns:
    """Return an empty table for `count` surfels."""
    surfels = SurfelColumns(*SURFELS.empty(count))
    surfels.cells[:] = -1
    return surfels
