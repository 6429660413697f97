"""The preallocated tables that the compiled pass fills: pairs of a sphere and a primitive, ramps, and jobs.

A **ramp** is how the overlap of one gripper sphere with one object grows along the way: eq. 11-12 over E. It is kept as
nodes (E, V, dV/dE), between which a cubic goes. A **job** is one overlap that a node needs, of one primitive.
"""

import math
from dataclasses import InitVar, dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.bundle import addresses, flags, indices, matrices, numbers, records, rows
from robot_side.compiled.kernel import inlined

Record = Any
"""One record of a table, whose fields no type checker knows."""
NODES: Final = 48
"""Of one ramp, at most."""
STRENGTHS: Final = 8
TOUCH_STRENGTH: Final = 4
"""The most that is felt in slow zones of what is to be touched."""
NEW, FIRST, GOING, DONE = 0, 1, 2, 3
"""States of a ramp: nothing is known; V(0) is asked for; more nodes may be; nothing more can come of it."""

RAMP: Final = np.dtype(
    [
        ("sphere", np.int64),
        ("object", np.int64),
        ("first_pair", np.int64),
        ("pairs", np.int64),
        ("state", np.int64),
        ("asked", np.int64),
        ("nodes", np.int64),
        ("touchable", np.int64),
        ("radius", np.float64),
        ("bare", np.int64),
        ("before", np.float64),
        ("early", np.float64),
        ("expected", np.float64),
        ("start", np.float64),
        ("free", np.float64),
        ("floor", np.float64),
        ("lean", np.float64),
        ("least", np.float64),
        ("rising", np.float64),
        ("most", np.float64),
        ("begins", np.float64),
        ("walked", np.int64),
        ("level", np.int64),
        ("along", np.float64),
        ("reached", np.float64),
        ("reference", np.float64),
        ("way", np.float64, (NODES,)),
        ("volume", np.float64, (NODES,)),
        ("slope", np.float64, (NODES,)),
        ("push", np.float64, (3,)),
    ]
)
"""One ramp. radius: of the sphere, inflated unless it is bare. early: by how much sooner it counts as its object comes
nearer; before: by that, and by D_σ for a bare sphere. expected: D_σ(P) - D_σ(0.5). start: no overlap grows before this
way. free: d; NaN while not known. floor: V(0). lean: |∇V(0)|. least: V_min. rising: what the primitives that still rise
add to the slope at the last node. most: by so much the overlap rises at most; infinite where nobody has worked that
out. begins: no strength that is to come begins before this way, less the margin. walked: up to this node it has
shortened the ways, -1 for not at all; level: by so many strengths; along, reached: the way until which that was, and
the strength there, as a share of the reference, what makes full strength."""

PAIR: Final = np.dtype([("row", np.int64), ("entry", np.float64), ("again", np.float64)])
"""A primitive's row in the scene, and the way at which the ramp's sphere begins to enter it: NaN for a mesh until that
is found out. again: where it may begin to enter it anew, after the last node, that way itself for at once; infinite
for what is convex, into which only what rises goes on to rise."""

JOB: Final = np.dtype([("ramp", np.int64), ("node", np.int64), ("row", np.int64)])
"""Whose an overlap is, and of which of the scene's rows."""
BLOCK: Final = 6
"""Spheres that follow each other, and are looked at as one first."""
MEETING: Final = np.dtype([("block", np.int64), ("object", np.int64), ("met", np.int64), ("bound", np.float64)])
"""A block of spheres may meet an object, at this way at the earliest, less what the object comes nearer; met: its ramps
are there, or not needed."""
WINDOW: Final = 0.5
"""What begins within so many margins of the nearest is worked out in the same round."""
BOX_JOBS, TETRAHEDRON_JOBS, MESH_JOBS = 0, 1, 2
JOB_KINDS: Final = 3
"""Boxes, tetrahedra and meshes have jobs; spheres and half-spaces are worked out on the spot."""


class JobColumns(NamedTuple):
    """Jobs as kernels read them, those of a kind together: j rows in all, r for each kind."""

    counts: IntArray
    """(3,) how many there are of boxes, tetrahedra and meshes"""
    owners: np.ndarray
    """(j,) JOB"""
    centers: FloatArray
    """(j, 3)"""
    radii: FloatArray
    """(j,)"""
    volumes: FloatArray
    """(j,) worked out"""
    gradients: FloatArray
    """(j, 3) worked out"""
    box_centers: FloatArray
    """(r, 3)"""
    box_rotations: FloatArray
    """(r, 3, 3)"""
    box_half_sizes: FloatArray
    """(r, 3)"""
    vertices: FloatArray
    """(r, 4, 3)"""
    areas: FloatArray
    """(j,) worked out"""
    unsettled: IntArray
    """(r + 1,) which of one kind need the precise forms"""
    kernels: IntArray
    """(4,) addresses of the kernels that work out boxes and tetrahedra: the lanes, then the precise forms; 0 for one
    that has not been needed yet"""


class JobParts(NamedTuple):
    """The first so many jobs of one kind, as the kernels of overlaps take them."""

    given: tuple[np.ndarray, ...]
    """Spheres' centres and radii, and the shapes"""
    results: tuple[np.ndarray, ...]
    """Volumes, gradients and areas"""
    unsettled: IntArray


class Jobs:
    """Room for so many overlaps of each kind."""

    def __init__(self, room: int) -> None:
        self.room = room
        self.columns = JobColumns(
            counts=np.zeros(JOB_KINDS, dtype=np.int64),
            owners=np.zeros(JOB_KINDS * room, dtype=JOB),
            centers=np.zeros((JOB_KINDS * room, 3)),
            radii=np.zeros(JOB_KINDS * room),
            volumes=np.zeros(JOB_KINDS * room),
            gradients=np.zeros((JOB_KINDS * room, 3)),
            box_centers=np.zeros((room, 3)),
            box_rotations=np.zeros((room, 3, 3)),
            box_half_sizes=np.zeros((room, 3)),
            vertices=np.zeros((room, 4, 3)),
            areas=np.zeros(JOB_KINDS * room),
            unsettled=np.zeros(room + 1, dtype=np.int64),
            kernels=np.zeros(4, dtype=np.int64),
        )
        self._parts: dict[tuple[int, int], JobParts] = {}

    def parts(self, kind: int, count: int, shapes: tuple[np.ndarray, ...]) -> JobParts:
        """The first `count` of a kind with these shapes; kept, as to make the views takes as long as an overlap."""
        known = self._parts.get((kind, count))
        if known is None:
            columns, part = self.columns, slice(kind * self.room, kind * self.room + count)
            known = self._parts[kind, count] = JobParts(
                (columns.centers[part], columns.radii[part], *(shape[:count] for shape in shapes)),
                (columns.volumes[part], columns.gradients[part], columns.areas[part]),
                columns.unsettled[: count + 1],
            )
        return known


PAIRS, RAMPS, LIMITED = 0, 1, 2
"""What is counted in `progress`: pairs, ramps, and spheres that were limited to half the gap (§3.4)."""
STEP, LEFT, ENTERED, ROUNDS, OVERLAPPED, WORK = 3, 4, 5, 6, 7, 8
"""And where a look stands: what comes next, meetings left, ramps before the last of them met, rounds begun, overlaps
worked out, and how much has been done: ramps met and nodes asked for."""
PROGRESS: Final = 9
MEET, ASK, TAKE = 0, 1, 2
"""Steps of a round."""


class TableColumns(NamedTuple):
    """The tables as kernels read and fill them, from `Tables.addresses`; the fields are those of Tables."""

    spheres: FloatArray
    on_finger: BoolArray
    sigma: FloatArray
    blocks: FloatArray
    meetings: np.ndarray
    ramps: np.ndarray
    pairs: np.ndarray
    near: IntArray
    progress: IntArray
    ways: FloatArray
    largest: FloatArray
    jobs: JobColumns


@inlined
def tables_at(bundle: IntArray) -> TableColumns:
    """The tables by their addresses, in kernels."""
    return TableColumns(
        rows(bundle, 0, 4),
        flags(bundle, 1),
        rows(bundle, 2, 2),
        rows(bundle, 3, 4),
        records(bundle, 4, MEETING),
        records(bundle, 5, RAMP),
        records(bundle, 6, PAIR),
        indices(bundle, 7),
        indices(bundle, 8),
        rows(bundle, 9, STRENGTHS),
        numbers(bundle, 10),
        JobColumns(
            indices(bundle, 11),
            records(bundle, 12, JOB),
            rows(bundle, 13, 3),
            numbers(bundle, 14),
            numbers(bundle, 15),
            rows(bundle, 16, 3),
            rows(bundle, 17, 3),
            matrices(bundle, 18, 3, 3),
            rows(bundle, 19, 3),
            matrices(bundle, 20, 4, 3),
            numbers(bundle, 21),
            indices(bundle, 22),
            indices(bundle, 23),
        ),
    )


@inlined
def begin(tables: TableColumns, meetings: int) -> None:
    """Forget the last look."""
    tables.progress[:] = 0
    tables.progress[STEP], tables.progress[LEFT] = MEET, meetings
    tables.ways[:] = math.inf


@dataclass
class Tables:
    """Made once, and made larger when a scene needs more."""

    meetings: np.ndarray = field(default_factory=lambda: np.zeros(256, dtype=MEETING))
    ramps: np.ndarray = field(default_factory=lambda: np.zeros(512, dtype=RAMP))
    pairs: np.ndarray = field(default_factory=lambda: np.zeros(2048, dtype=PAIR))
    jobs: Jobs = field(default_factory=lambda: Jobs(1024))
    near: IntArray = field(default_factory=lambda: np.zeros(1024, dtype=np.int64))
    most_spheres: InitVar[int] = 512

    def __post_init__(self, most_spheres: int) -> None:
        self.progress: IntArray = np.zeros(PROGRESS, dtype=np.int64)
        self.ways_m: FloatArray = np.zeros((2, STRENGTHS))
        """Fast and slow, of the last look"""
        self.largest_m: FloatArray = np.zeros(1)
        """D_σ, of all spheres"""
        self._make_room(most_spheres)

    def _make_room(self, spheres: int) -> None:
        self.spheres: FloatArray = np.zeros((spheres, 4))
        """(m or more, 4) centres and radii of the gripper's"""
        self.on_finger: BoolArray = np.zeros(spheres, dtype=np.bool_)
        self.sigma_m: FloatArray = np.zeros((spheres, 2))
        """(m or more, 2) D_σ of each sphere along the direction: at P, and expected (P = 0.5)"""
        self.blocks: FloatArray = np.zeros((spheres // BLOCK + 1, 4))
        """Centre and radius of a sphere around each block, inflated."""
        self._join()

    def _join(self) -> None:
        self.addresses: IntArray = addresses(
            *(self.spheres, self.on_finger, self.sigma_m, self.blocks, self.meetings, self.ramps, self.pairs),
            *(self.near, self.progress, self.ways_m, self.largest_m, *self.jobs.columns),
        )
        """What kernels read and fill of them: a bundle for `tables_at`."""

    def require(self, spheres: int, primitives: int) -> None:
        """Make room for so many spheres and primitives."""
        if spheres > len(self.sigma_m):
            self._make_room(2 * spheres)
        if primitives > len(self.near):
            self.near = np.zeros(2 * primitives, dtype=np.int64)
            self._join()

    def grow_meetings(self, count: int) -> None:
        """Make room for so many meetings."""
        self.meetings = np.zeros(2 * count, dtype=MEETING)
        self._join()

    def grow_ramps(self) -> None:
        """Make room for as many ramps and pairs again."""
        self.ramps = np.concatenate([self.ramps, np.zeros_like(self.ramps)])
        self.pairs = np.concatenate([self.pairs, np.zeros_like(self.pairs)])
        self._join()

    def grow_jobs(self) -> None:
        """Make room for as many jobs again, and forget those that there are."""
        self.jobs = Jobs(2 * self.jobs.room)
        self._join()
