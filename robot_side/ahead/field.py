"""The field along one direction: the ways at which the eight strengths begin."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray, require_finite
from robot_side.ahead.ask import ask
from robot_side.ahead.feel import take
from robot_side.ahead.find import find
from robot_side.ahead.meet import COUNTED, LIMITED, RAMPS, meet
from robot_side.ahead.overlaps import work_out
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import STRENGTHS, Tables
from robot_side.arm.port import GripperPose

if TYPE_CHECKING:
    from robot_side.ahead.mesh_ways import MeshWays

MARGIN_M = 0.012
"""m: over this way before the one at which full strength is due, strength grows."""
LEAST_DEPTH_M = 0.0005
"""What comes no deeper into a sphere of radius R is a graze: V_min = π R (0.5 mm)². Noise in the encoders turns a way
aside by less."""
_MOST_ROUNDS = 1000


@dataclass(frozen=True)
class Along:
    """A direction, and how uncertain what lies along it is (eq. 9-10)."""

    direction: FloatArray
    """û (3,), unit, in the world frame"""
    mean_m: float
    """û·(μ_ee - μ_c) + μ_δ"""
    variance_m2: float
    """σ_c² + σ_δ²"""
    quantile: float
    """Φ⁻¹(P)"""
    reach_m: float
    """How far ahead is looked."""
    early_m: FloatArray | None = None
    """(k,) by how much each object's ways are shorter, as it comes towards the gripper; None: all stand still"""


@dataclass(frozen=True)
class Field:
    """What is ahead along one direction, as it was when it was looked at."""

    fast_m: FloatArray
    """(8,) the ways at which strengths 1 to 8 begin, never falling; infinite beyond the reach"""
    slow_m: FloatArray
    """(8,) the same where what is to be touched is felt less, and where it is expected"""
    sigma_m: float
    """The largest D_σ of the gripper's spheres."""


@dataclass
class FieldCounts:
    """How much work there was, over the run."""

    fields: int = 0
    ramps: int = 0
    """Pairs of a sphere and an object that the sphere meets within the reach."""
    overlaps: int = 0
    """Of boxes, tetrahedra and meshes."""
    limited: int = 0
    """Spheres whose D_σ was limited to half the gap between the fingers (§3.4)."""
    with_nothing_near: int = 0
    """Fields of which no block of spheres met anything."""
    flat: int = 0
    """Primitives of the newest scene without volume: nothing can overlap them, so that nobody feels them."""


@dataclass
class Ahead:
    """Looks ahead along directions; keeps the tables that this takes."""

    encoder_sigma_rad: FloatArray
    """(n,)"""
    margin_m: float = MARGIN_M
    least_depth_m: float = LEAST_DEPTH_M
    counts: FieldCounts = field(default_factory=FieldCounts)
    tables: Tables = field(default_factory=Tables)

    def __post_init__(self) -> None:
        self._encoder_variance = self.encoder_sigma_rad * self.encoder_sigma_rad

    def look(
        self, pose: GripperPose, scene: SceneTable, standing: IntArray, along: Along, widest_m: float = np.inf
    ) -> Field:
        """The field at `pose`; standing (k,): what each object is (see `find`); widest_m: half the fingers' gap.

        ValueError that names the field of `pose` or `along` that holds NaN or infinity: that would compare as far away
        and silently give no warning.
        """
        tables, counts = self.tables, self.counts
        spheres = _spheres(pose)
        tables.require(len(spheres), len(scene.bounds))
        early_m = np.zeros(len(standing)) if along.early_m is None else along.early_m
        meetings = self._find(pose, spheres, scene, standing, along, early_m)
        fast, slow = np.full(STRENGTHS, np.inf), np.full(STRENGTHS, np.inf)
        counts.fields += 1
        counts.flat = scene.flat
        sigma_m = float(tables.sigma_m[: len(spheres), 0].max())
        if meetings:
            found = np.zeros(COUNTED, dtype=np.int64)
            self._shorten(pose, spheres, scene, standing, along, early_m, widest_m, meetings, fast, slow, found)
            # Beyond the reach not all is known.
            fast[fast > along.reach_m] = slow[slow > along.reach_m] = np.inf
            counts.ramps += int(found[RAMPS])
            counts.limited += int(found[LIMITED])
        else:
            counts.with_nothing_near += 1
        return Field(fast, slow, sigma_m)

    def _find(
        self,
        pose: GripperPose,
        spheres: FloatArray,
        scene: SceneTable,
        standing: IntArray,
        along: Along,
        early_m: FloatArray,
    ) -> int:
        tables = self.tables
        while True:
            count: int = find(
                spheres,
                pose.tool_position_m,
                np.ascontiguousarray(pose.tool_jacobian),
                self._encoder_variance,
                along.direction,
                along.mean_m,
                along.variance_m2,
                along.quantile,
                along.reach_m + self.margin_m,
                standing,
                early_m,
                *scene.columns,
                tables.sigma_m,
                tables.blocks,
                tables.meetings,
                tables.near,
            )
            if count < 0:
                _refuse(pose, along)
            if count <= len(tables.meetings):
                return count
            tables.meetings = np.zeros(2 * count, dtype=tables.meetings.dtype)

    def _shorten(
        self,
        pose: GripperPose,
        spheres: FloatArray,
        scene: SceneTable,
        standing: IntArray,
        along: Along,
        early_m: FloatArray,
        widest_m: float,
        meetings: int,
        fast: FloatArray,
        slow: FloatArray,
        found: IntArray,
    ) -> None:
        """Round after round, the nearest first, until nothing could shorten a way any more."""
        tables = self.tables
        reach_m = along.reach_m + self.margin_m
        on_finger = _as_indices(pose.sphere_on_finger)
        meshes = _mesh_ways(scene, tables, spheres, along.direction, reach_m, self.margin_m)
        left = meetings
        for _ in range(_MOST_ROUNDS):
            known = int(found[RAMPS])
            if left:
                left = meet(
                    spheres,
                    on_finger,
                    along.direction,
                    widest_m,
                    self.margin_m,
                    reach_m,
                    self.least_depth_m,
                    slow,
                    tables.meetings,
                    meetings,
                    standing,
                    early_m,
                    *scene.columns,
                    tables.sigma_m,
                    tables.blocks,
                    tables.ramps,
                    tables.pairs,
                    tables.near,
                    found,
                )
                if meshes is not None:
                    meshes.enter(slice(known, int(found[RAMPS])))
                if left < 0:
                    tables.grow()
                    continue
            jobs = tables.jobs
            of_ramps = tables.ramps, tables.pairs, int(found[RAMPS]), self.margin_m, reach_m, fast, slow
            asked = ask(spheres, along.direction, *of_ramps, *scene.columns, *jobs.columns)
            if asked < 0:
                tables.jobs = type(jobs)(2 * jobs.room)
                continue
            if asked == 0 and left == 0:
                return
            self.counts.overlaps += work_out(jobs, scene)
            if meshes is not None:
                meshes.look_again(int(found[RAMPS]))
            done = jobs.columns
            take(along.direction, *of_ramps, done.counts, done.owners, done.volumes, done.gradients)


def _mesh_ways(
    scene: SceneTable, tables: Tables, spheres: FloatArray, direction: FloatArray, reach_m: float, margin_m: float
) -> "MeshWays | None":
    if not scene.has_meshes:
        return None
    # A scene without meshes does not load the kernels for them.
    from robot_side.ahead.mesh_ways import MeshWays  # noqa: PLC0415

    return MeshWays(scene, tables, spheres, direction, reach_m + margin_m, margin_m)


def _spheres(pose: GripperPose) -> FloatArray:
    """Centres and radii (m, 4)."""
    return np.concatenate([pose.sphere_centers_m, pose.sphere_radii_m[:, None]], axis=1)


def _refuse(pose: GripperPose, along: Along) -> NoReturn:
    """Raise the ValueError that says what is not finite."""
    for name in ("tool_position_m", "tool_jacobian", "sphere_centers_m", "sphere_radii_m"):
        require_finite(f"pose.{name}", getattr(pose, name))
    for name in ("direction", "mean_m", "variance_m2", "quantile", "reach_m"):
        require_finite(f"along.{name}", getattr(along, name))
    raise ValueError("the encoders' errors or the sums of all these are not finite; valid: metres and radians")


def _as_indices(flags: BoolArray) -> IntArray:
    return flags.astype(np.int64)
