"""Objects from the camera: spheres, boxes, tetrahedra, half-spaces, meshes and ellipsoids, each with a role."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, Protocol, runtime_checkable

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.surroundings.kinds import box, ellipsoid, half_space, mesh, sphere, tetrahedron

if TYPE_CHECKING:
    # A scene without meshes does not load the kernels for them.
    from robot_side.overlap.meshes.mesh_library import MeshLibrary


KINDS: Final = (sphere.KIND, box.KIND, tetrahedron.KIND, half_space.KIND, mesh.KIND, ellipsoid.KIND)
"""Kinds of primitives; each has the index that is its number in `kinds.layout`, and its arrays in PerceivedObjects."""


@dataclass(frozen=True, eq=False)
class UnknownSpace:
    """Shares, 0 to 1, of the space on each side of the gripper that nobody has seen, and where it counts."""

    ahead: float
    left: float
    right: float
    up: float
    down: float
    boxes_m: FloatArray = field(default_factory=lambda: np.empty((0, 2, 3)))
    """(u, 2, 3) lower and upper corners, in the world frame, of boxes of at most half strength, which share no space;
    none if unknown space is free"""

    @property
    def shares(self) -> tuple[float, float, float, float, float]:
        """Shares ahead, left, right, up and down"""
        return self.ahead, self.left, self.right, self.up, self.down


@dataclass(frozen=True, eq=False)
class PerceivedObjects:
    """Objects at their perceived poses, in the world frame, as contiguous arrays by kind of primitive.

    An object may consist of several primitives: `*_object` (k,) holds each primitive's index into `names`. Ignored
    objects have no primitives. Frames compare by identity. The fields' texts give the arrays' shapes.
    """

    time_s: float
    """Time of the frame, in s"""
    names: tuple[str, ...]
    roles: tuple[Role, ...]
    sphere_centers_m: FloatArray
    """(s, 3) centres of the spheres"""
    sphere_radii_m: FloatArray
    """(s,) radii of the spheres"""
    sphere_object: IntArray
    box_centers_m: FloatArray
    """(b, 3) centres of the boxes"""
    box_rotations: FloatArray
    """(b, 3, 3) rotations of the boxes, box to world"""
    box_half_sizes_m: FloatArray
    """(b, 3) half sizes of the boxes"""
    box_object: IntArray
    tetrahedron_vertices_m: FloatArray
    """(t, 4, 3) corners of the tetrahedra"""
    tetrahedron_object: IntArray
    half_space_normals: FloatArray
    """(p, 3) unit normals of the half-spaces, which are solid where normal·x <= offset"""
    half_space_offsets_m: FloatArray
    """(p,) offsets of the half-spaces"""
    half_space_object: IntArray
    mesh_library: "MeshLibrary | None" = None
    """Shapes of meshes, prepared once for all frames; None without meshes"""
    mesh_index: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """(q,) index of each mesh's shape in `mesh_library`"""
    mesh_positions_m: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    """(q, 3) origins of the meshes' own frames"""
    mesh_rotations: FloatArray = field(default_factory=lambda: np.empty((0, 3, 3)))
    """(q, 3, 3) rotations of the meshes, mesh to world"""
    mesh_object: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    ellipsoid_centers_m: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    """(e, 3) centres of the ellipsoids"""
    ellipsoid_rotations: FloatArray = field(default_factory=lambda: np.empty((0, 3, 3)))
    """(e, 3, 3) rotations of the ellipsoids, ellipsoid to world"""
    ellipsoid_half_axes_m: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    """(e, 3) half axes of the ellipsoids"""
    ellipsoid_object: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    positions_m: FloatArray | None = field(default_factory=lambda: None)
    """(k, 3) origin of each object's own frame (its first primitive's) in the world frame; None if unknown"""
    rotations: FloatArray | None = field(default_factory=lambda: None)
    """(k, 3, 3) rotation from each object's own frame to the world frame; None if unknown"""
    velocities_m_s: FloatArray | None = field(default_factory=lambda: None)
    """(k, 3) velocity of each object in the world frame. None if not measured; objects then count as at rest."""
    sds_m: FloatArray | None = field(default_factory=lambda: None)
    """(k,) standard deviation σ_c of each object's position along each axis; NaN: that of the settings. None: for all.
    """
    surfaces: IntArray | None = field(default_factory=lambda: None)
    """(k,) number, 0 to k - 1, of the surface that each object is a piece of; -1: it stands alone. None: all do. The
    law takes the obstacles of one surface for one object (docs/feel.md)."""
    unseen_m: float = 0.0
    """Distance by which each object may have moved since it was seen, in any direction"""
    late_s: float = 0.0
    """Time by which moving objects may be ahead of or behind their positions, as the frame's age is not known well"""
    unknown: UnknownSpace | None = field(default_factory=lambda: None)
    """Space that nobody has seen; None if nobody says"""
    since: "tuple[SomeObjects, FloatArray] | None" = field(default=None, init=False, repr=False)
    """Movers that made this frame, and their numbers; None if any object may have moved"""


def displaced(objects: PerceivedObjects, by_m: FloatArray) -> PerceivedObjects:
    """Return the frame with every object moved by `by_m` (3,), in the world frame."""
    return replace(
        objects,
        sphere_centers_m=objects.sphere_centers_m + by_m,
        box_centers_m=objects.box_centers_m + by_m,
        tetrahedron_vertices_m=objects.tetrahedron_vertices_m + by_m,
        half_space_offsets_m=objects.half_space_offsets_m + objects.half_space_normals @ by_m,
        mesh_positions_m=objects.mesh_positions_m + by_m,
        ellipsoid_centers_m=objects.ellipsoid_centers_m + by_m,
    )


def library_of(sources: Sequence[tuple[bytes, bytes]]) -> "MeshLibrary":
    """Return the library of meshes with these vertices and triangles, see `Source`."""
    # A scene without meshes does not load the kernels for them.
    from robot_side.overlap.meshes.mesh_library import MeshLibrary, Source  # noqa: PLC0415

    known = tuple(Source(*source) for source in sources)
    return MeshLibrary([source.mesh() for source in known], known)


class SomeObjects(Protocol):
    """Objects of a frame that may be elsewhere in later frames; `movers.Movers` documents the fields."""

    first: PerceivedObjects
    things: IntArray
    first_rows: IntArray
    measured: bool
    parts: Mapping[str, Any]

    @property
    def at_first(self) -> FloatArray:
        """Numbers of these objects in the frame `first`"""
        ...


@runtime_checkable
class PutBack(Protocol):
    """Source that can forget what was seen."""

    def put_back(self) -> None:
        """Forget what was seen, as the objects were put back."""
        ...


class ObjectSource(Protocol):
    """A camera with segmentation, simulated or real."""

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`: the same object until there is a newer one."""
        ...

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of the object `name`, from the next frame on."""
        ...
