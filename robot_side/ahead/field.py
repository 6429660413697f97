"""The field along one direction: the ways at which the eight strengths begin."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NoReturn

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.ahead.find import find
from robot_side.ahead.rounds import ENDED, MORE_JOBS, MORE_RAMPS, OVERLAPS, PAUSED, go_on
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import ENTERED, LIMITED, OVERLAPPED, RAMPS, WORK, Tables
from robot_side.ahead.total_overlap import work_out
from robot_side.arm.port import GripperPose

if TYPE_CHECKING:
    from robot_side.ahead.mesh_ways import MeshWays

MARGIN_M = 0.012
"""m: over this way before the one at which full strength is due, strength grows."""
LEAST_DEPTH_M = 0.0005
"""What comes no deeper into a sphere of radius R is a graze: V_min = π R (0.5 mm)². Noise in the encoders turns a way
aside by less."""
ALL: Final = 1 << 60
"""More ramps and nodes than any look takes."""


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

    ways_m: FloatArray
    """(2, 8) the ways at which strengths 1 to 8 begin, never falling, infinite beyond the reach: the fast list, and the
    slow one, where what is to be touched is felt less, and where it is expected"""
    sigma_m: float
    """The largest D_σ of the gripper's spheres."""

    @property
    def fast_m(self) -> FloatArray:
        """(8,)"""
        fast_m: FloatArray = self.ways_m[0]
        return fast_m

    @property
    def slow_m(self) -> FloatArray:
        """(8,)"""
        slow_m: FloatArray = self.ways_m[1]
        return slow_m


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
        self._given: tuple[Any, ...] = ()
        self._looking: tuple[SceneTable, bool]
        self._meshes: MeshWays | None = None

    def look(
        self, pose: GripperPose, scene: SceneTable, standing: IntArray, along: Along, widest_m: float = np.inf
    ) -> Field:
        """The field at `pose`; standing (k,): what each object is (see `find`); widest_m: half the fingers' gap.

        ValueError that names the field of `pose` or `along` that holds NaN or infinity: that would compare as far away
        and silently give no warning.
        """
        self.begin(pose, scene, standing, along, widest_m)
        while (found := self.go_on()) is None:
            pass
        return found

    def begin(
        self, pose: GripperPose, scene: SceneTable, standing: IntArray, along: Along, widest_m: float = np.inf
    ) -> None:
        """Begin such a look, instead of the last one; `scene` and `standing` must stay as they are until it ends."""
        tables, size = self.tables, len(pose.sphere_radii_m)
        tables.require(size, len(scene.bounds))
        early_m = scene.still_m if along.early_m is None else along.early_m
        meetings = self._find(pose, scene, standing, along, early_m)
        self.counts.fields += 1
        self.counts.flat = scene.flat
        self.counts.with_nothing_near += not meetings
        looked = along.direction, along.reach_m, self.margin_m, widest_m, self.least_depth_m
        self._given = size, meetings, *looked, scene.has_meshes, standing, early_m, scene.addresses
        self._looking = scene, meetings > 0
        self._meshes = _mesh_ways(scene, tables, along.direction, along.reach_m + self.margin_m, self.margin_m)

    @property
    def work(self) -> int:
        """How much this look has taken so far: ramps and nodes."""
        return int(self.tables.progress[WORK])

    def go_on(self, most: int = ALL) -> Field | None:
        """Go on with the look for so many ramps and nodes, or a few more; the field once it is known."""
        tables, progress, meshes = self.tables, self.tables.progress, self._meshes
        scene, meets = self._looking
        most += self.work
        while meets and (what := go_on(most, *self._given, tables.addresses)) != ENDED:
            if what == PAUSED:
                return None
            if what == OVERLAPS:
                work_out(tables.jobs, scene)
                if meshes is not None:
                    meshes.look_again(int(progress[RAMPS]))
            elif what == MORE_RAMPS:
                tables.grow_ramps()
            elif what == MORE_JOBS:
                tables.grow_jobs()
            elif meshes is not None:
                meshes.enter(slice(int(progress[ENTERED]), int(progress[RAMPS])))
        self.counts.ramps += int(progress[RAMPS])
        self.counts.overlaps += int(progress[OVERLAPPED])
        self.counts.limited += int(progress[LIMITED])
        return Field(tables.ways_m.copy(), float(tables.largest_m[0]))

    def _find(self, pose: GripperPose, scene: SceneTable, standing: IntArray, along: Along, early_m: FloatArray) -> int:
        while True:
            count: int = find(
                np.ascontiguousarray(pose.sphere_centers_m),
                pose.sphere_radii_m,
                pose.sphere_on_finger,
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
                0.0 if along.early_m is None else float(early_m.max(initial=0.0)),
                scene.addresses,
                self.tables.addresses,
            )
            if count < 0:
                _refuse(pose, along)
            if count <= len(self.tables.meetings):
                return count
            self.tables.grow_meetings(count)


def _mesh_ways(
    scene: SceneTable, tables: Tables, direction: FloatArray, reach_m: float, margin_m: float
) -> "MeshWays | None":
    if not scene.has_meshes:
        return None
    # A scene without meshes does not load the kernels for them.
    from robot_side.ahead.mesh_ways import MeshWays  # noqa: PLC0415

    return MeshWays(scene, tables, direction, reach_m + margin_m, margin_m)


def _refuse(pose: GripperPose, along: Along) -> NoReturn:
    """Raise the ValueError that says what is not finite."""
    for name in ("tool_position_m", "tool_jacobian", "sphere_centers_m", "sphere_radii_m"):
        require_finite(f"pose.{name}", getattr(pose, name))
    for name in ("direction", "mean_m", "variance_m2", "quantile", "reach_m"):
        require_finite(f"along.{name}", getattr(along, name))
    raise ValueError("the encoders' errors or the sums of all these are not finite; valid: metres and radians")
