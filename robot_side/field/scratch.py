"""Scratch memory of a look: allocated for a gripper and a scene, and kept, so that a look allocates nothing."""

from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.columns import FLAGS, INDICES, NUMBERS, Declared, records, rows

STRENGTHS: Final = 8
TOUCH_STRENGTH: Final = 4
"""Highest strength in slow zones for an object that is to be touched"""
CLUSTER: Final = 6
"""Number of consecutive gripper spheres in one bounding sphere"""
SAMPLES: Final = 4
"""Steps between samples of an overlap profile over the margin; even, so that one sample lies in the middle"""

PAIR: Final = np.dtype(
    [
        *((name, np.int64) for name in ("sphere", "object", "overlaps", "touchable")),
        *((name, np.float64) for name in ("radius", "contact", "closing", "lead", "expected")),
    ]
)
"""One gripper sphere and one object. radius: inflated, unless the sphere counts uninflated. contact: distance of the
first contact, 0 if they overlap (`overlaps`). closing: û·n of the contact plane; 0 for a mesh. lead: distance by which
strengths begin sooner: errors along the motion, the object's approach, and the inflation of an uninflated sphere.
expected: D_σ(P) - D_σ(0.5) of an object that is to be touched (`touchable`), else 0."""

ENTRY: Final = np.dtype(
    [
        ("row", np.int64),
        *((name, np.float64) for name in ("enters", "closing", "again", "volume", "slope")),
        *((f"{name}_{place}", np.float64) for place in (0, 1) for name in ("at", "root", "steep")),
    ]
)
"""Row of a primitive that a pair's sphere enters. enters: distance. closing: û·n of the contact plane, above 0 if the
primitive is convex. again: distance at which its overlap may rise again after a fall. volume, slope: of the newest
sample. at, root, steep: distance, value and slope of two tangents to the overlap's cube root."""


class Count(IntEnum):
    """Counts of a look."""

    PAIRS = 0
    """Pairs of a sphere and an object within the reach"""
    PROFILES = 1
    """Overlap profiles of pairs that were sampled"""
    OVERLAPS = 2
    """Overlaps of one sphere and one primitive"""
    LIMITED = 3
    """Spheres whose D_σ was limited to half the gap between the fingers (§3.4)"""


class Error(IntEnum):
    """Errors along the direction of a look, in m."""

    LARGEST = 0
    """Largest D_σ"""
    ALONG = 1
    """Largest part of D_σ that does not inflate: it shortens contact distances"""
    EXPECTED = 2
    """D_σ at P = 0.5"""


class Bundles(NamedTuple):
    """Bundles of a scene and the scratch.

    Kernels pass these on: a call with all columns costs more than most functions here.
    """

    scene: IntArray
    scratch: IntArray


class ScratchColumns(NamedTuple):
    """Columns of the bundle; the fields are those of Scratch."""

    spheres: FloatArray
    on_finger: BoolArray
    inflation_m: FloatArray
    sigma_m: FloatArray
    clusters: FloatArray
    keys_m: FloatArray
    items: IntArray
    pairs: np.ndarray
    objects: IntArray
    bounds_m: FloatArray
    rows: IntArray
    entries: np.ndarray
    samples: FloatArray
    overlap_gradient: FloatArray
    distances_m: FloatArray
    along_m: FloatArray
    counts: IntArray


SCRATCH: Final = Declared(
    ScratchColumns,
    *(rows(4), FLAGS, rows(1), rows(1), rows(4), NUMBERS, INDICES, records(PAIR), INDICES, NUMBERS, INDICES),
    *(records(ENTRY), rows(2), NUMBERS, rows(STRENGTHS), NUMBERS, INDICES),
)


class Scratch:
    """Scratch memory for m gripper spheres, n primitives and k objects."""

    def __init__(self, spheres: int, primitives: int, objects: int) -> None:
        self.spheres: FloatArray = np.zeros((spheres, 4))
        """Centres and radii"""
        self.on_finger: BoolArray = np.zeros(spheres, dtype=np.bool_)
        self.inflation_m: FloatArray = np.zeros((spheres, 1))
        """Inflation by errors of camera and arm at P"""
        self.sigma_m: FloatArray = np.zeros((spheres, 1))
        """D_σ at P, with the prediction error"""
        self.clusters: FloatArray = np.zeros((spheres // CLUSTER + 1, 4))
        """Bounding sphere of each cluster of inflated spheres"""
        self.keys_m: FloatArray = np.zeros(2 * spheres + len(self.clusters))
        self.items: IntArray = np.zeros(len(self.keys_m), dtype=np.int64)
        """Queue of clusters and pairs, nearest first"""
        self.pairs: np.ndarray = np.zeros(2 * spheres + 1, dtype=PAIR)
        """Pairs of one object, and one more"""
        self.objects: IntArray = np.zeros(objects, dtype=np.int64)
        self.bounds_m: FloatArray = np.zeros(objects)
        """Queue of objects within the reach, nearest first"""
        self.rows: IntArray = np.zeros(primitives, dtype=np.int64)
        """Primitives of one object within the reach"""
        self.entries: np.ndarray = np.zeros(primitives, dtype=ENTRY)
        self.samples: FloatArray = np.zeros((SAMPLES + 1, 2))
        """V and dV/dE over the margin"""
        self.overlap_gradient: FloatArray = np.zeros(3)
        """dV/dcentre of the newest overlap"""
        self.distances_m: FloatArray = np.zeros((2, STRENGTHS))
        """Onset distances, fast and slow"""
        self.along_m: FloatArray = np.zeros(len(Error))
        """Errors, indexed by `Error`"""
        self.counts: IntArray = np.zeros(len(Count), dtype=np.int64)
        self.bundle = SCRATCH.bundle(self)

    def fits(self, spheres: int, primitives: int, objects: int) -> bool:
        """Return whether there is room for these numbers of spheres, primitives and objects."""
        return spheres <= len(self.spheres) and primitives <= len(self.rows) and objects <= len(self.objects)
