"""Spheres of the objects that may be held, found when the objects are first known: a tick is too short for it."""

from collections.abc import Collection
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.roles import Role
from robot_side.gripper.kept_covers import SearchNotes, kept_cover
from robot_side.gripper.search_work import SearchWork
from robot_side.gripper.solids import Solid, convex_solid
from robot_side.gripper.spheres import cells_cover, cover_boxes
from robot_side.gripper.surface_cover import cover_surface
from robot_side.surroundings.perceived import KINDS, PerceivedObjects

if TYPE_CHECKING:
    from robot_side.overlap.meshes.mesh_library import MeshLibrary

_MOST_SHAPES = 32
"""Maximum number of meshes, and of objects of tetrahedra, for which spheres are searched; a first search takes up to
seconds."""
_MOST_TETRAHEDRA = 64
_MOST_BOXES = 16
"""Number of an object's boxes from which on no few spheres are searched: those are surfaces that a camera saw"""
_WIDEST_M = 0.2
"""Width, in m: an object that is wider in every direction fits no gripper."""
_SAME_VOLUME = 1e-6
_SLIVER = 1e-3
_DIGITS = 9

_Spheres = tuple[FloatArray, FloatArray]
"""Centres (m, 3) and radii (m,)."""


class HeldCovers:
    """Covers by spheres of all objects of a scene, whose shapes stay constant.

    Balls need no search, and boxes a short one. A mesh is covered in its own frame, once for each shape. Spheres of
    tetrahedra are stored by barycentric coordinates. Some objects are not searched: those too large to grip, those of
    too many tetrahedra, and those after the first 32. Such an object gets the spheres of a box, or a ball around each
    tetrahedron.
    """

    def __init__(
        self,
        objects: PerceivedObjects,
        stand_out_m: float = 0.003,
        never_held: Collection[str] = (),
        searching: SearchNotes | None = None,
    ) -> None:
        """Find covers that serve every frame of these objects. never_held: those that cannot be held, left out.

        searching: told of each search, but not of a stored cover.
        """
        self._stand_out_m = stand_out_m
        self._meshes: dict[int, _Spheres] = {}
        self._tetrahedra: dict[str, tuple[IntArray, FloatArray, FloatArray]] = {}
        coarse: dict[str, float] = {}
        corners = [] if objects.mesh_library is None else objects.mesh_library.corners_m
        first = sorted(range(len(objects.names)), key=lambda index: objects.roles[index] is not Role.TARGET)
        for place, index in enumerate(first, 1):
            if objects.roles[index] is Role.SUPPORT or objects.names[index] in never_held:
                continue
            name, stand_outs = objects.names[index], [0.0]
            told = None if searching is None else partial(searching.at, f"object {name!r}, {place} of {len(first)}")
            for mesh in np.unique(objects.mesh_index[objects.mesh_object == index]).tolist():
                if objects.mesh_library is not None and mesh not in self._meshes and self._may_search(corners[mesh]):
                    solid = _mesh_solid(objects.mesh_library, mesh, corners[mesh])
                    found = kept_cover(
                        corners[mesh].tobytes() + repr(stand_out_m).encode(),
                        partial(cover_surface, [solid], stand_out_m, [np.eye(3)], work=SearchWork(told=told)),
                    )
                    self._meshes[mesh] = found[:2]
                    stand_outs.append(found[2])
            vertices = objects.tetrahedron_vertices_m[objects.tetrahedron_object == index]
            if 0 < len(vertices) <= _MOST_TETRAHEDRA and self._may_search(vertices):
                # Relative and rounded, so that the same shape elsewhere has the same cover.
                vertices = (vertices - vertices[0, 0]).round(_DIGITS)
                solids = _tetrahedra_solids(vertices)
                if solids:
                    centers, radii, stand_out = kept_cover(
                        vertices.tobytes() + repr(stand_out_m).encode(),
                        partial(cover_surface, solids, stand_out_m, work=SearchWork(told=told)),
                    )
                    self._tetrahedra[name] = (*_shares(vertices, centers), radii)
                    stand_outs.append(stand_out)
            if max(stand_outs) > stand_out_m * (1.0 + 1e-9):
                coarse[name] = max(stand_outs)
        self._plan_boxes(objects, never_held)
        self.coarse: tuple[tuple[str, float], ...] = tuple(coarse.items())
        """(name, distance in m) of each object whose spheres protrude from it by more than `stand_out_m`, namely by the
        distance"""

    def _plan_boxes(self, objects: PerceivedObjects, never_held: Collection[str]) -> None:
        """Cover a box of each size once, to fill the cache: the first cover of a size takes several ticks."""
        names_and_roles = zip(objects.names, objects.roles, strict=True)
        lifted = [role is not Role.SUPPORT and name not in never_held for name, role in names_and_roles]
        for kind in KINDS:
            if kind.in_box and kind.derive is None:
                half_sizes_m = kind.read(objects)[2][np.array(lifted, dtype=np.bool_)[getattr(objects, kind.owner)]]
                sizes = np.unique(half_sizes_m, axis=0)
                for size in sizes[2.0 * sizes.min(axis=1, initial=np.inf) <= _WIDEST_M][:_MOST_SHAPES]:
                    cover_boxes(np.zeros((1, 3)), np.eye(3)[None], size[None], self._stand_out_m)

    def _may_search(self, points_m: FloatArray) -> bool:
        few = len(self._meshes) + len(self._tetrahedra) < _MOST_SHAPES
        return few and float(np.ptp(points_m.reshape(-1, 3), axis=0).min()) <= _WIDEST_M

    def spheres(self, objects: PerceivedObjects, index: int) -> _Spheres:
        """Return centres (m, 3) in the world frame and radii (m,) for the object `index` at its pose in `objects`."""
        balls = objects.sphere_object == index
        found = [(objects.sphere_centers_m[balls], objects.sphere_radii_m[balls])]
        for row in np.flatnonzero(objects.mesh_object == index).tolist():
            if (known := self._meshes.get(int(objects.mesh_index[row]))) is not None:
                found.append((objects.mesh_positions_m[row] + known[0] @ objects.mesh_rotations[row].T, known[1]))
        for kind in KINDS:
            rows = getattr(objects, kind.owner) == index
            if kind.name == "mesh":
                rows &= ~np.isin(objects.mesh_index, list(self._meshes))
            if kind.in_box and rows.any():
                centers, rotations, half_sizes, *_ = (column[rows] for column in kind.read(objects))
                if len(centers) > _MOST_BOXES:
                    found.append(cells_cover(centers, rotations, half_sizes))
                    continue
                cover = cover_boxes(centers, rotations, half_sizes, self._stand_out_m)
                spheres: _Spheres = cover.centers_m, cover.radii_m
                found.append(
                    _near_ellipsoids(spheres, centers, rotations, half_sizes) if kind.name == "ellipsoid" else spheres
                )
        vertices = objects.tetrahedron_vertices_m[objects.tetrahedron_object == index]
        if (shared := self._tetrahedra.get(objects.names[index])) is not None and len(vertices):
            of, shares, radii = shared
            found.append((np.einsum("mv,mvi->mi", shares, vertices[of]), radii))
        else:
            middles = vertices.mean(axis=1)
            found.append((middles, np.linalg.norm(vertices - middles[:, None, :], axis=2).max(axis=1, initial=0.0)))
        return np.concatenate([centers for centers, _ in found]), np.concatenate([radii for _, radii in found])


def _near_ellipsoids(
    spheres: _Spheres, middles_m: FloatArray, rotations: FloatArray, half_axes_m: FloatArray
) -> _Spheres:
    """Return those of the spheres that may reach any of the ellipsoids (e,).

    If a sphere reaches an ellipsoid, the sphere's centre is in an enlarged ellipsoid. Its half axes are longer by the
    sphere's radius times the ratio of the longest half axis to the shortest.
    """
    centers_m, radii_m = spheres
    own = np.einsum("eij,mei->mej", rotations, centers_m[:, None] - middles_m)
    with np.errstate(divide="ignore", invalid="ignore"):
        longer = half_axes_m + radii_m[:, None, None] * (half_axes_m.max(axis=1) / half_axes_m.min(axis=1))[:, None]
        reached: BoolArray = ~(((own / longer) ** 2).sum(axis=2).min(axis=1) > 1.0)
    return centers_m[reached], radii_m[reached]


def _mesh_solid(library: "MeshLibrary", mesh: int, corners_m: FloatArray) -> Solid:
    """Return the solid of a library's mesh, in the mesh's own frame."""
    hull = convex_solid(np.unique(corners_m.reshape(-1, 3), axis=0))
    if hull is not None and _fills(hull, float(library.tables.volumes[mesh])):
        return hull
    # A scene without meshes does not load the kernels for them.
    from robot_side.overlap.meshes.mesh_library import nearest_mesh_pairs  # noqa: PLC0415

    def depth_m(points: FloatArray) -> FloatArray:
        turns = np.ascontiguousarray(np.broadcast_to(np.eye(3), (len(points), 3, 3)))
        index, origin = np.full(len(points), mesh, dtype=np.int64), np.zeros((len(points), 3))
        return -nearest_mesh_pairs(np.ascontiguousarray(points), library, index, origin, turns)[0]

    return Solid(corners_m, depth_m)


def _fills(hull: Solid, volume_m3: float) -> bool:
    """Return whether a solid with this volume and convex hull fills the hull, so is convex."""
    a, b, c = np.moveaxis(hull.corners_m - hull.corners_m[0, 0], 1, 0)
    around_m3 = float(np.sum(a * np.cross(b, c)) / 6.0)
    return abs(volume_m3 - around_m3) <= _SAME_VOLUME * around_m3


def _tetrahedra_solids(vertices_m: FloatArray) -> list[Solid]:
    """Return one solid if the tetrahedra (t, 4, 3) fill a convex shape, else one for each that is not flat."""
    volumes = np.abs(np.linalg.det(vertices_m[:, 1:] - vertices_m[:, :1])) / 6.0
    whole = convex_solid(vertices_m.reshape(-1, 3))
    if whole is None:
        return []
    if _fills(whole, float(volumes.sum())):
        return [whole]
    return [solid for vertices in vertices_m if (solid := convex_solid(vertices)) is not None]


def _shares(vertices_m: FloatArray, centers_m: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return for each centre (m, 3) the tetrahedron (m,) that contains it, and its barycentric coordinates (m, 4).

    vertices_m (t, 4, 3): of all tetrahedra.
    """
    volumes = np.abs(np.linalg.det(vertices_m[:, 1:] - vertices_m[:, :1]))
    # Slivers are ill-conditioned as frames of reference.
    rows = np.flatnonzero(volumes >= _SLIVER * volumes.max())
    edges = np.moveaxis(vertices_m[rows, 1:] - vertices_m[rows, :1], 1, 2)
    along = np.linalg.solve(edges, (centers_m - vertices_m[rows, :1]).transpose(0, 2, 1)).transpose(0, 2, 1)
    shares = np.concatenate([1.0 - along.sum(axis=2, keepdims=True), along], axis=2)
    within = shares.min(axis=2).argmax(axis=0)
    return rows[within], shares[within, np.arange(len(centers_m))]
