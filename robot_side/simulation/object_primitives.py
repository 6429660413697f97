"""The primitives of a scene's objects: which geoms are spheres, boxes, tetrahedra, meshes, half-spaces; and where."""

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.simulation.mesh_arrays import mesh_vertices
from robot_side.simulation.model_enums import GeomKind

if TYPE_CHECKING:
    from robot_side.overlap.meshes.mesh_library import MeshLibrary
    from robot_side.simulation.geom_meshes import GeomMesh

_EXACT = {GeomKind.SPHERE: "sphere", GeomKind.BOX: "box", GeomKind.PLANE: "plane"}
_MESHES = {GeomKind.CAPSULE, GeomKind.ELLIPSOID, GeomKind.CYLINDER, GeomKind.MESH, GeomKind.HFIELD}
"""What a mesh describes, unless it is a tetrahedron."""


_ARRAYS: Final = {
    "sphere": ("_radii_m",),
    "box": ("_box_offsets_m", "_box_half_sizes_m"),
    "tetrahedron": ("_corners_m",),
    "mesh": ("_mesh_index",),
    "plane": (),
}
"""Of each kind those with a row for each primitive, besides geoms and objects."""


@dataclass(frozen=True)
class SceneObject:
    """A thing in the scene that is not the robot: one tree of bodies, or one geom that is fixed to the world."""

    name: str
    geoms: tuple[int, ...]
    """Those that can touch something."""


class ObjectPrimitives:
    """The objects' shapes in their geoms' frames, ready to be placed in the world once for each frame.

    A sphere, a box, a plane, a closed mesh and a height field are exact. A cylinder, a capsule and an ellipsoid stand
    for meshes around them, a mesh that is not closed for its convex hull, and any other shape for its bounding box.
    """

    def __init__(self, model: Any, objects: Sequence[SceneObject]) -> None:
        """Read the shapes of `objects` from a compiled MuJoCo model."""
        self._names = tuple(thing.name for thing in objects)
        geoms = [(geom, index) for index, thing in enumerate(objects) for geom in thing.geoms]
        of_kind: dict[str, list[tuple[int, int]]] = {"sphere": [], "box": [], "tetrahedron": [], "plane": []}
        wanted: list[tuple[int, int]] = []
        for geom, index in geoms:
            kind = _primitive_kind(model, geom)
            (wanted if kind is None else of_kind[kind]).append((geom, index))
        self._mesh_library, meshes, boxes = _meshes(model, [geom for geom, _ in wanted])
        of_kind["box"] += [(geom, index) for geom, index in wanted if geom in boxes]
        of_kind["mesh"] = [(geom, index) for geom, index in wanted if geom in meshes]
        volume_errors: dict[str, float] = {}
        stands_out_m: dict[str, float] = {}
        for geom, index in wanted:
            name, mesh = self._names[index], meshes[geom][1] if geom in meshes else None
            if mesh is None or mesh.volume_error > 0.0:
                share, distance_m = (mesh.volume_error, mesh.stands_out_m) if mesh else (math.inf, math.inf)
                volume_errors[name] = max(share, volume_errors.get(name, 0.0))
                stands_out_m[name] = max(distance_m, stands_out_m.get(name, 0.0))
        self.volume_errors: Mapping[str, float] = volume_errors
        """Of each object that is seen larger than it is, the greatest share by which a part's volume is greater.

        Infinite for what has no known volume of its own, and stands for its convex hull or bounding box.
        """
        self.stands_out_m: Mapping[str, float] = stands_out_m
        """And how far what is seen of it reaches beyond it, at most."""

        self._sphere_geoms, self._sphere_object = _columns(of_kind["sphere"])
        self._radii_m: FloatArray = model.geom_size[self._sphere_geoms, 0].copy()
        self._box_geoms, self._box_object = _columns(of_kind["box"])
        self._box_offsets_m: FloatArray = model.geom_aabb[self._box_geoms, :3].copy()
        self._box_half_sizes_m: FloatArray = model.geom_aabb[self._box_geoms, 3:].copy()
        self._tetrahedron_geoms, self._tetrahedron_object = _columns(of_kind["tetrahedron"])
        self._corners_m: FloatArray = np.array(
            [mesh_vertices(model, int(geom)) for geom in self._tetrahedron_geoms], dtype=np.float64
        ).reshape(-1, 4, 3)
        self._mesh_geoms, self._mesh_object = _columns(of_kind["mesh"])
        self._mesh_index = np.array([meshes[int(geom)][0] for geom in self._mesh_geoms], dtype=np.int64)
        self._plane_geoms, self._plane_object = _columns(of_kind["plane"])

    def only(self, things: IntArray) -> "ObjectPrimitives":
        """Those of some of the objects, things (m,), rising: by their places among these."""
        part = copy(self)
        part._names = tuple(self._names[thing] for thing in things)
        for kind, arrays in _ARRAYS.items():
            owners = getattr(self, f"_{kind}_object")
            kept = np.isin(owners, things)
            setattr(part, f"_{kind}_object", np.searchsorted(things, owners[kept]))
            for name in (f"_{kind}_geoms", *arrays):
                setattr(part, name, getattr(self, name)[kept])
        return part

    def place(
        self,
        time_s: float,
        roles: Mapping[str, Role],
        offsets_m: FloatArray,
        geom_positions_m: FloatArray,
        geom_rotations: FloatArray,
    ) -> PerceivedObjects:
        """The objects in the world, each moved by its row of `offsets_m` (k, 3); ignored ones without primitives.

        geom_positions_m (g, 3) and geom_rotations (g, 9) are the model's geoms in the world frame.
        """
        seen = np.array([roles[name] is not Role.IGNORED for name in self._names], dtype=bool)

        def placed(kind: str) -> tuple[BoolArray, IntArray, FloatArray, FloatArray]:
            """Which of a kind are seen, their objects (p,), positions (p, 3) and rotations (p, 3, 3)."""
            owners, geoms = getattr(self, f"_{kind}_object"), getattr(self, f"_{kind}_geoms")
            kept = seen[owners]
            positions_m = geom_positions_m[geoms[kept]] + offsets_m[owners[kept]]
            return kept, owners[kept], positions_m, geom_rotations[geoms[kept]].reshape(-1, 3, 3)

        spheres, sphere_object, sphere_centers_m, _ = placed("sphere")
        boxes, box_object, box_places_m, box_rotations = placed("box")
        tetrahedra, tetrahedron_object, tetrahedron_centers_m, tetrahedron_rotations = placed("tetrahedron")
        meshes, mesh_object, mesh_positions_m, mesh_rotations = placed("mesh")
        _, plane_object, plane_points_m, plane_rotations = placed("plane")
        normals = np.ascontiguousarray(plane_rotations[:, :, 2])
        return PerceivedObjects(
            time_s=time_s,
            names=self._names,
            roles=tuple(roles[name] for name in self._names),
            sphere_centers_m=sphere_centers_m,
            sphere_radii_m=self._radii_m[spheres],
            sphere_object=sphere_object,
            box_centers_m=box_places_m + np.einsum("bij,bj->bi", box_rotations, self._box_offsets_m[boxes]),
            box_rotations=box_rotations,
            box_half_sizes_m=self._box_half_sizes_m[boxes],
            box_object=box_object,
            tetrahedron_vertices_m=tetrahedron_centers_m[:, None, :]
            + np.einsum("tij,tvj->tvi", tetrahedron_rotations, self._corners_m[tetrahedra]),
            tetrahedron_object=tetrahedron_object,
            half_space_normals=normals,
            half_space_offsets_m=np.einsum("pi,pi->p", normals, plane_points_m),
            half_space_object=plane_object,
            mesh_library=self._mesh_library,
            mesh_index=self._mesh_index[meshes],
            mesh_positions_m=mesh_positions_m,
            mesh_rotations=mesh_rotations,
            mesh_object=mesh_object,
        )


def _primitive_kind(model: Any, geom: int) -> str | None:
    kind = int(model.geom_type[geom])
    if kind == GeomKind.MESH:
        # An open surface of four vertices has no more inside than any other.
        mesh = model.geom_dataid[geom]
        return "tetrahedron" if model.mesh_vertnum[mesh] == 4 and model.mesh_facenum[mesh] == 4 else None
    return _EXACT.get(GeomKind(kind)) if kind in set(GeomKind) else None


def _meshes(
    model: Any, geoms: Sequence[int]
) -> tuple["MeshLibrary | None", dict[int, tuple[int, "GeomMesh"]], frozenset[int]]:
    """The library, (mesh index, mesh) of each geom that has a mesh, and the geoms that have none."""
    candidates = [geom for geom in geoms if int(model.geom_type[geom]) in _MESHES]
    if not candidates:
        return None, {}, frozenset(geoms)
    # A scene without meshes does not load the kernels for them.
    from robot_side.simulation.geom_meshes import GeomMeshes  # noqa: PLC0415

    shapes = GeomMeshes(model)
    found = {geom: shape for geom in candidates if (shape := shapes.add(geom)) is not None}
    return shapes.mesh_library(), found, frozenset(geoms) - found.keys()


def _columns(pairs: list[tuple[int, int]]) -> tuple[IntArray, IntArray]:
    both = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return both[:, 0].copy(), both[:, 1].copy()
