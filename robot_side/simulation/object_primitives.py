"""The primitives of a scene's objects: which geoms are spheres, boxes, tetrahedra, meshes, half-spaces; and where."""

import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.simulation.mesh_arrays import mesh_vertices
from robot_side.simulation.model_enums import GeomKind
from robot_side.surroundings.perceived import KINDS, PerceivedObjects, Role

if TYPE_CHECKING:
    from robot_side.overlap.meshes.mesh_library import MeshLibrary
    from robot_side.simulation.geom_meshes import GeomMesh

_EXACT: Final[Mapping[GeomKind, str]] = {
    GeomKind.SPHERE: "sphere",
    GeomKind.BOX: "box",
    GeomKind.PLANE: "half_space",
    GeomKind.ELLIPSOID: "ellipsoid",
}
_MESHES = {GeomKind.CAPSULE, GeomKind.CYLINDER, GeomKind.MESH, GeomKind.HFIELD}
"""What a mesh describes, unless it is a tetrahedron."""
_SIZES: Final[Mapping[str, Callable[[Any, IntArray], tuple[FloatArray, ...]]]] = {
    "sphere": lambda model, geoms: (model.geom_size[geoms, 0],),
    "box": lambda model, geoms: (model.geom_aabb[geoms, :3], model.geom_aabb[geoms, 3:]),
    "tetrahedron": lambda model, geoms: (
        np.array([mesh_vertices(model, geom) for geom in geoms.tolist()], dtype=np.float64).reshape(-1, 4, 3),
    ),
    "half_space": lambda _model, _geoms: (),
    "ellipsoid": lambda model, geoms: (model.geom_size[geoms],),
}
"""By kind but meshes the sizes of geoms (k,) in their own frames, as `Kind.placed` takes them."""


_OfKind = tuple[IntArray, IntArray, tuple[Any, ...]]
"""The geoms (k,) of a kind, their objects (k,), and their sizes."""


@dataclass(frozen=True)
class SceneObject:
    """A thing in the scene that is not the robot: one tree of bodies, or one geom that is fixed to the world."""

    name: str
    geoms: tuple[int, ...]
    """Those that can touch something."""


class ObjectPrimitives:
    """The objects' shapes in their geoms' frames, ready to be placed in the world once for each frame.

    A sphere, a box, a plane, an ellipsoid, a closed mesh and a height field are exact. A cylinder and a capsule stand
    for meshes around them, a mesh that is not closed for its convex hull, and any other shape for its bounding box.
    """

    def __init__(self, model: Any, objects: Sequence[SceneObject]) -> None:
        """Read the shapes of `objects` from a compiled MuJoCo model."""
        self._names = tuple(thing.name for thing in objects)
        geoms = [(geom, index) for index, thing in enumerate(objects) for geom in thing.geoms]
        of_kind: dict[str, list[tuple[int, int]]] = {kind.name: [] for kind in KINDS}
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

        self._of_kind: dict[str, _OfKind] = {}
        for name, pairs in of_kind.items():
            own, owners = np.array(pairs, dtype=np.int64).reshape(-1, 2).T.copy()
            sizes = _SIZES.get(name)
            mesh_index = [meshes[geom][0] for geom in own.tolist()] if sizes is None else []
            self._of_kind[name] = own, owners, sizes(model, own) if sizes else (np.array(mesh_index, dtype=np.int64),)

    def only(self, things: IntArray) -> "ObjectPrimitives":
        """Those of some of the objects, things (m,), rising: by their places among these."""
        part = copy(self)
        part._names = tuple(self._names[thing] for thing in things)
        part._of_kind = {}
        for name, (geoms, owners, sizes) in self._of_kind.items():
            kept = np.isin(owners, things)
            mine = np.searchsorted(things, owners[kept])
            part._of_kind[name] = geoms[kept], mine, tuple(values[kept] for values in sizes)
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

        arrays: dict[str, Any] = {}
        for kind in KINDS:
            geoms, owners, sizes = self._of_kind[kind.name]
            kept = seen[owners]
            owners, geoms = owners[kept], geoms[kept]
            positions_m, rotations = geom_positions_m[geoms] + offsets_m[owners], geom_rotations[geoms]
            values = kind.placed(positions_m, rotations.reshape(-1, 3, 3), *(size[kept] for size in sizes))
            arrays |= {array.name: value for array, value in zip(kind.arrays, values, strict=True)}
            arrays[kind.owner] = owners
        return PerceivedObjects(
            time_s=time_s,
            names=self._names,
            roles=tuple(roles[name] for name in self._names),
            mesh_library=self._mesh_library,
            **arrays,
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
