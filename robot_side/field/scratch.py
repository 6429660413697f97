"""Scratch memory of a look. It is allocated once for a gripper and a scene, so that a look allocates nothing."""

from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.arm.port import CLUSTER
from robot_side.compiled.columns import FLAGS, INDICES, NUMBERS, Declared, records, rows

STRENGTHS: Final = 8
TOUCH_STRENGTH: Final = 4
"""Highest strength in slow zones for an object that is to be touched"""
SAMPLES: Final = 4
"""Number of steps into which samples divide an overlap profile's margin; even, so that one sample is in the middle"""

PAIR: Final = np.dtype(
    [
        *((name, np.int64) for name in ("sphere", "object", "overlaps", "touchable")),
        *((name, np.float64) for name in ("radius", "contact", "closing", "lead", "expected")),
    ]
)
"""Pair of one gripper sphere and one object. radius: with inflation, unless this pair takes the uninflated sphere.
contact: distance of the first contact, 0 if they overlap at the start (`overlaps` is 1 then). closing: û·n of the
contact plane; 0 for a mesh with dents. lead: distance by which all strengths begin sooner. It is the sum of the errors
along the motion, the object's approach, and the inflation if the sphere is uninflated. touchable: 1 for an object that
is to be touched. expected: D_σ(P) - D_σ(0.5) for such an object, else 0."""

PART: Final = 6 * CLUSTER
"""Number of gripper spheres in a part, which several clusters make up"""
ROWS_TOGETHER: Final = 16
"""Number of kept rows in a block"""
MOST_WORK: Final = 120_000
"""Pairs that touch and computed overlaps after which a tick's looks are cut short: 8 ms with boxes, 45 ms with
tetrahedra. A gripper 20 mm above a table of 12 tetrahedra needs up to 82 000 while it moves, of two boxes 94 000."""
ENTRY: Final = np.dtype(
    [
        ("row", np.int64),
        *((name, np.float64) for name in ("enters", "closing", "again", "volume", "slope")),
        *((f"{name}_{place}", np.float64) for place in (0, 1) for name in ("at", "root", "steep")),
    ]
)
"""Primitive that a pair's sphere enters. row: the primitive's row in the scene's table. enters: distance at which the
sphere enters. closing: û·n of the contact plane, above 0 if the primitive is convex. again: distance at which the
overlap may rise again after a fall. volume, slope: overlap and its slope at the newest sample. Two tangents to the
overlap's cube root, 0 and 1, each touch at the distance `at` with the value `root` and the slope `steep`."""


class Count(IntEnum):
    """What a look counts, as indices."""

    PAIRS = 0
    """Pairs of a gripper sphere and an object that touch within the examined distance"""
    PROFILES = 1
    """Pairs whose overlap profile was sampled"""
    OVERLAPS = 2
    """Computed overlaps of one sphere and one primitive"""
    LIMITED = 3
    """Spheres whose inflation was limited to half the gap between the fingers (§3.4)"""
    CUT = 4
    """1 if the look was cut short, as it had done more than `MOST_WORK`; all strengths then begin at once"""
    ENTERED = 5
    """Pairs of a gripper sphere and a primitive that it enters: those whose overlaps may be computed"""


class Error(IntEnum):
    """Indices of the errors along the direction of a look, in m, over all gripper spheres."""

    LARGEST = 0
    """Largest D_σ"""
    ALONG = 1
    """Largest D_σ - I: the part that does not inflate a sphere but shortens its contact distances"""
    EXPECTED = 2
    """D_σ at P = 0.5, the same for all spheres"""


class OfSurface(IntEnum):
    """Indices of a surface's numbers."""

    BOUND = 0
    """Key of the surface, the least of its pieces'"""
    VOLUME = 1
    UNSEEN = 2
    """Largest motion of its pieces that nobody saw"""
    VARIANCE = 3
    """Variance of its pieces' positions that makes the most of the errors"""
    APPROACH = 4
    """Largest distance by which its pieces approach"""


class Bundles(NamedTuple):
    """Bundles of a scene and of the scratch.

    Kernels pass these two arguments to each other, because passing all arrays would cost more than most functions here.
    """

    scene: IntArray
    scratch: IntArray


class ScratchColumns(NamedTuple):
    """Arrays of the scratch memory as kernels see them; `Scratch` describes each field."""

    spheres: FloatArray
    on_finger: BoolArray
    kinematic_m2: FloatArray
    inflation_m: FloatArray
    sigma_m: FloatArray
    clusters: FloatArray
    cluster_ranges: FloatArray
    parts: FloatArray
    part_ranges: FloatArray
    whole: FloatArray
    whole_range: FloatArray
    keys_m: FloatArray
    items: IntArray
    pairs: np.ndarray
    objects: IntArray
    bounds_m: FloatArray
    near: BoolArray
    first_pieces: IntArray
    of_surfaces: FloatArray
    rows: IntArray
    row_bounds: FloatArray
    row_blocks: FloatArray
    entries: np.ndarray
    samples: FloatArray
    overlap_gradient: FloatArray
    distances_m: FloatArray
    along_m: FloatArray
    counts: IntArray


SCRATCH: Final = Declared(
    ScratchColumns,
    *(rows(4), FLAGS, rows(1), rows(1), rows(1), *(rows(4), rows(3)) * 3, NUMBERS, INDICES, records(PAIR)),
    *(INDICES, NUMBERS, FLAGS, INDICES, rows(len(OfSurface)), INDICES, rows(4), rows(4)),
    *(records(ENTRY), rows(2), NUMBERS, rows(STRENGTHS), NUMBERS, INDICES),
)


class Scratch:
    """Scratch memory for m gripper spheres, n primitives and k objects."""

    def __init__(self, spheres: int, primitives: int, objects: int) -> None:
        self.spheres: FloatArray = np.zeros((spheres, 4))
        """Centre and radius of each gripper sphere, in m"""
        self.on_finger: BoolArray = np.zeros(spheres, dtype=np.bool_)
        self.kinematic_m2: FloatArray = np.zeros((spheres, 1))
        """Variance of each sphere's position from the encoders, along the direction of the look"""
        self.inflation_m: FloatArray = np.zeros((spheres, 1))
        """Inflation I of each sphere of an examined cluster, towards the present object: by camera and arm, at P"""
        self.sigma_m: FloatArray = np.zeros((spheres, 1))
        """D_σ of each sphere at P, by the largest errors of all objects: errors of camera, arm and prediction"""
        self.clusters: FloatArray = np.zeros((spheres // CLUSTER + 1, 4))
        """Bounding sphere of each cluster of inflated spheres"""
        self.cluster_ranges: FloatArray = np.zeros((len(self.clusters), 3))
        """Radius of each cluster's bounding sphere without inflation, and least and largest of `kinematic_m2`"""
        self.parts: FloatArray = np.zeros((spheres // PART + 1, 4))
        self.part_ranges: FloatArray = np.zeros((len(self.parts), 3))
        """The same of each part of the gripper"""
        self.whole: FloatArray = np.zeros((1, 4))
        self.whole_range: FloatArray = np.zeros((1, 3))
        """The same of the whole gripper"""
        self.keys_m: FloatArray = np.zeros(2 * spheres + len(self.clusters) + len(self.parts))
        self.items: IntArray = np.zeros(len(self.keys_m), dtype=np.int64)
        """Queue of one object's parts, clusters and pairs, nearest first; `keys_m` has their keys"""
        self.pairs: np.ndarray = np.zeros(2 * spheres + 1, dtype=PAIR)
        """Pairs of the present object, at most two for each sphere, and one row to try"""
        self.objects: IntArray = np.zeros(objects, dtype=np.int64)
        self.bounds_m: FloatArray = np.zeros(objects)
        """Keys of `objects`, the queue of the objects within the reach, nearest first"""
        self.near: BoolArray = np.zeros(objects, dtype=np.bool_)
        """Whether each piece is within the reach"""
        self.first_pieces: IntArray = np.zeros(objects, dtype=np.int64)
        """Place of each surface's first piece among the scene's pieces"""
        self.of_surfaces: FloatArray = np.zeros((objects, len(OfSurface)))
        """Numbers of each surface, indexed by `OfSurface`"""
        self.rows: IntArray = np.zeros(primitives, dtype=np.int64)
        """Rows of the present object's primitives within the reach"""
        self.row_bounds: FloatArray = np.zeros((primitives, 4))
        """Centre and radius around each of them"""
        self.row_blocks: FloatArray = np.zeros((primitives // ROWS_TOGETHER + 1, 4))
        """Centre and radius around each block of them"""
        self.entries: np.ndarray = np.zeros(primitives, dtype=ENTRY)
        self.samples: FloatArray = np.zeros((SAMPLES + 1, 2))
        """Kept samples of an overlap profile over the margin: V and dV/dE"""
        self.overlap_gradient: FloatArray = np.zeros(3)
        """Gradient dV/dcentre of the newest overlap"""
        self.distances_m: FloatArray = np.zeros((2, STRENGTHS))
        """Result: onset distances, the fast list and the slow list"""
        self.along_m: FloatArray = np.zeros(len(Error))
        """Errors, indexed by `Error`"""
        self.counts: IntArray = np.zeros(len(Count), dtype=np.int64)
        self.bundle = SCRATCH.bundle(self)

    def fits(self, spheres: int, primitives: int, objects: int) -> bool:
        """Return whether there is room for these numbers of spheres, primitives and objects."""
        return spheres <= len(self.spheres) and primitives <= len(self.rows) and objects <= len(self.objects)
