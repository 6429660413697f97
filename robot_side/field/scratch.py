"""Room in which one look works: made for a gripper and a scene, and kept, so that a look allocates nothing."""

from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.columns import FLAGS, INDICES, NUMBERS, Declared, records, rows

STRENGTHS: Final = 8
TOUCH_STRENGTH: Final = 4
"""The most that is felt in slow zones of an object that is to be touched."""
CLUSTER: Final = 6
"""Gripper spheres that follow each other, and are passed over together."""
SAMPLES: Final = 4
"""Steps between samples of an overlap profile over the margin; even, so that one lies in its middle"""

PAIR: Final = np.dtype(
    [
        *((name, np.int64) for name in ("sphere", "object", "overlaps", "touchable")),
        *((name, np.float64) for name in ("radius", "contact", "closing", "lead", "expected")),
    ]
)
"""One gripper sphere and one object. radius: inflated, unless the sphere counts uninflated. contact: the distance at
which it first touches, 0 where it overlaps (`overlaps`). closing: û·n of the plane in which it does so; 0 for a mesh.
lead: strengths begin sooner by this, by the errors along the motion, as the object comes nearer, and by the inflation
of an uninflated sphere. expected: D_σ(P) - D_σ(0.5) of an object that is to be touched (`touchable`), else 0."""

ENTRY: Final = np.dtype(
    [
        ("row", np.int64),
        *((name, np.float64) for name in ("enters", "closing", "again", "volume", "slope")),
        *((f"{name}_{place}", np.float64) for place in (0, 1) for name in ("at", "root", "steep")),
    ]
)
"""A primitive's row that a pair's sphere enters, at which distance, and û·n of the plane in which it does so: above 0
where it is convex. again: where its overlap may rise again after it has fallen. volume, slope: of the newest sample.
at, root, steep: where the tangents to the overlap's cube root touch it, and how steeply."""


class Count(IntEnum):
    """What a look counts."""

    PAIRS = 0
    """Pairs of a sphere and an object within the reach"""
    PROFILES = 1
    """Of these, overlap profiles that were sampled"""
    OVERLAPS = 2
    """Overlaps of one sphere and one primitive"""
    LIMITED = 3
    """Spheres whose D_σ was limited to half the gap between the fingers (§3.4)"""


class Error(IntEnum):
    """Errors along the direction of a look, in m."""

    LARGEST = 0
    """The largest D_σ"""
    ALONG = 1
    """The most of D_σ that does not inflate: ways are shorter by this"""
    EXPECTED = 2
    """D_σ at P = 0.5"""


class Bundles(NamedTuple):
    """A scene and the scratch by their bundles.

    Kernels hand these on: a call with all their columns costs more than what most functions here do.
    """

    scene: IntArray
    scratch: IntArray


class ScratchColumns(NamedTuple):
    """The room as kernels see it; the fields are those of Scratch."""

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
    push: FloatArray
    distances_m: FloatArray
    along_m: FloatArray
    counts: IntArray


SCRATCH: Final = Declared(
    ScratchColumns,
    *(rows(4), FLAGS, rows(1), rows(1), rows(4), NUMBERS, INDICES, records(PAIR), INDICES, NUMBERS, INDICES),
    *(records(ENTRY), rows(2), NUMBERS, rows(STRENGTHS), NUMBERS, INDICES),
)


class Scratch:
    """The room for m gripper spheres, n primitives and k objects."""

    def __init__(self, spheres: int, primitives: int, objects: int) -> None:
        self.spheres: FloatArray = np.zeros((spheres, 4))
        """Centres and radii"""
        self.on_finger: BoolArray = np.zeros(spheres, dtype=np.bool_)
        self.inflation_m: FloatArray = np.zeros((spheres, 1))
        """By what camera and arm may miss, at P"""
        self.sigma_m: FloatArray = np.zeros((spheres, 1))
        """D_σ at P, with what the prediction may miss"""
        self.clusters: FloatArray = np.zeros((spheres // CLUSTER + 1, 4))
        """A sphere around each cluster of inflated ones"""
        self.keys_m: FloatArray = np.zeros(2 * spheres + len(self.clusters))
        self.items: IntArray = np.zeros(len(self.keys_m), dtype=np.int64)
        """A queue of clusters and pairs, the nearest first"""
        self.pairs: np.ndarray = np.zeros(2 * spheres + 1, dtype=PAIR)
        """Those of one object, and room for one more"""
        self.objects: IntArray = np.zeros(objects, dtype=np.int64)
        self.bounds_m: FloatArray = np.zeros(objects)
        """A queue of objects within the reach, the nearest first"""
        self.rows: IntArray = np.zeros(primitives, dtype=np.int64)
        """Primitives of one object within the reach"""
        self.entries: np.ndarray = np.zeros(primitives, dtype=ENTRY)
        self.samples: FloatArray = np.zeros((SAMPLES + 1, 2))
        """V and dV/dE over the margin"""
        self.push: FloatArray = np.zeros(3)
        """dV/dcentre of the newest overlap"""
        self.distances_m: FloatArray = np.zeros((2, STRENGTHS))
        """At which the strengths begin, fast and slow"""
        self.along_m: FloatArray = np.zeros(len(Error))
        """At the places of `Error`"""
        self.counts: IntArray = np.zeros(len(Count), dtype=np.int64)
        self.bundle = SCRATCH.bundle(self)

    def fits(self, spheres: int, primitives: int, objects: int) -> bool:
        """Whether there is room for these numbers of spheres, primitives and objects."""
        return spheres <= len(self.spheres) and primitives <= len(self.rows) and objects <= len(self.objects)
