"""Primitives that describe a scene's objects: made from MuJoCo's geoms, and placed in the world for each frame."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.roles import Role
from robot_side.drivers.mujoco.mesh_arrays import mesh_vertices
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.surroundings.kinds.layout import MESH, NUMBERS, rows
from robot_side.surroundings.kinds.mesh import of_library
from robot_side.surroundings.perceived import KINDS, PerceivedObjects
from robot_side.surroundings.placing import grouped

if TYPE_CHECKING:
    from robot_side.drivers.mujoco.geom_meshes import GeomMesh
    from robot_side.overlap.meshes.mesh_library import MeshLibrary

_EXACT: Final[Mapping[GeomKind, str]] = {
    GeomKind.SPHERE: "sphere",
    GeomKind.BOX: "box",
    GeomKind.PLANE: "half_space",
    GeomKind.ELLIPSOID: "ellipsoid",
}
_MESHES = {GeomKind.CAPSULE, GeomKind.CYLINDER, GeomKind.MESH, GeomKind.HFIELD}
"""Kinds of geoms that a mesh describes, except for a tetrahedron"""
_SIZES: Final[Mapping[str, Callable[[Any, IntArray], tuple[FloatArray, ...]]]] = {
    "sphere": lambda model, geoms: (model.geom_size[geoms, 0],),
    "box": lambda model, geoms: (model.geom_aabb[geoms],),
    "tetrahedron": lambda model, geoms: (
        np.array([mesh_vertices(model, geom) for geom in geoms.tolist()], dtype=np.float64).reshape(-1, 12),
    ),
    "half_space": lambda _model, geoms: (np.empty((len(geoms), 0)),),
    "ellipsoid": lambda model, geoms: (model.geom_size[geoms],),
}
"""Functions that read sizes of geoms (k,) in their own frames, as `Kind.placed` takes them, for each kind but meshes"""


@dataclass(frozen=True)
class SceneObject:
    """Object of the scene that is not of the robot: one tree of bodies, or one geom that is fixed to the world."""

    name: str
    geoms: tuple[int, ...]
    """Geoms of the object that can touch something"""


class ObjectPrimitives:
    """Shapes of the objects in the frames of their geoms, to be placed in the world for each frame.

    A sphere, a box, a plane, an ellipsoid, a closed mesh and a height field are exact. A cylinder or capsule becomes a
    mesh around it, a mesh that is not closed its convex hull, and any other shape its bounding box.
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
        """Greatest share by which a part's perceived volume is too large, for each object that is perceived larger than
        it is.
        Infinite for a part whose volume is not known, and whose convex hull or bounding box is used."""
        self.stands_out_m: Mapping[str, float] = stands_out_m
        """Largest distance, in m, by which the perceived shape of each such object protrudes from the true shape"""

        mesh_index = np.array([meshes[geom][0] for geom, _ in of_kind["mesh"]], dtype=np.int64)
        self._mesh_index: IntArray = mesh_index
        pairs = [pair for kind in KINDS for pair in of_kind[kind.name]]
        own, owners = np.array(pairs, dtype=np.int64).reshape(-1, 2).T.copy()
        kinds = np.repeat(np.arange(len(KINDS)), [len(of_kind[kind.name]) for kind in KINDS])
        sizes = [
            _SIZES[kind.name](model, own[kinds == number])
            if kind.name in _SIZES
            else (of_library(self._mesh_library, mesh_index),)
            for number, kind in enumerate(KINDS)
        ]
        of_each = np.concatenate([rows(*columns, width=NUMBERS) for columns in sizes])
        self._primitives = _Primitives(kinds, own, owners, of_each)
        """Primitives of all objects, grouped by kind"""
        self._first_geoms = np.array([thing.geoms[0] for thing in objects], dtype=np.int64)

    def _seen(self, roles: Mapping[str, Role]) -> BoolArray:
        """Return (n,): whether each primitive belongs to an object that is not ignored."""
        seen = np.array([roles[name] is not Role.IGNORED for name in self._names], dtype=np.bool_)
        return seen[self._primitives.owners]

    def moving(self, things: IntArray, roles: Mapping[str, Role]) -> "MovingPrimitives":
        """Return the primitives of those objects of `things` (m,), ascending, that are not ignored.

        The order is that of `movers`.
        """
        owners = self._primitives.owners
        kept = np.flatnonzero(self._seen(roles) & np.isin(owners, things))
        kept = kept[np.argsort(owners[kept], kind="stable")]
        return MovingPrimitives(self._primitives.only(kept), things, self._first_geoms[things])

    def perceived(
        self,
        time_s: float,
        roles: Mapping[str, Role],
        offsets_m: FloatArray,
        geom_positions_m: FloatArray,
        geom_rotations: FloatArray,
    ) -> PerceivedObjects:
        """Return the objects in the world, each moved by its row of `offsets_m` (k, 3); ignored ones lack primitives.

        geom_positions_m (g, 3) and geom_rotations (g, 9): poses of the model's geoms in the world frame.
        """
        kept = np.flatnonzero(self._seen(roles))
        primitives = self._primitives.only(kept)
        seen = MovingPrimitives(primitives, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
        numbers = seen.numbers(offsets_m, geom_positions_m, geom_rotations)
        meshes = np.flatnonzero(self._primitives.kinds == MESH)
        arrays: dict[str, Any] = {"mesh_index": self._mesh_index[np.isin(meshes, kept)]}
        for number, kind in enumerate(KINDS):
            mine = primitives.kinds == number
            arrays[kind.owner] = primitives.owners[mine]
            for name, (part, row) in kind.parts.items():
                arrays[name] = numbers[mine, part].reshape(-1, *row)
        return PerceivedObjects(
            time_s=time_s,
            names=self._names,
            roles=tuple(roles[name] for name in self._names),
            mesh_library=self._mesh_library,
            **arrays,
        )


class _Primitives(NamedTuple):
    """Primitives (n) in the frames of their geoms; arrays (n,)."""

    kinds: IntArray
    geoms: IntArray
    owners: IntArray
    """Index of each primitive's object among all objects"""
    sizes: FloatArray
    """(n, 20) sizes as `Kind.placed` takes them"""

    def only(self, places: IntArray) -> "_Primitives":
        """Return the primitives at the indices `places`."""
        return _Primitives(self.kinds[places], self.geoms[places], self.owners[places], self.sizes[places])


class MovingPrimitives:
    """Primitives of some objects (m), to be placed at the poses of MuJoCo's geoms."""

    def __init__(self, primitives: _Primitives, things: IntArray, first_geoms: IntArray) -> None:
        """first_geoms (m,): first geom of each object, whose frame is the object's."""
        self._things, self._first_geoms = things, first_geoms
        self._groups = [(kind, rows, primitives.only(rows)) for kind, rows in grouped(primitives.kinds)]
        self._count = len(primitives.kinds)

    def numbers(self, offsets_m: FloatArray, geom_positions_m: FloatArray, geom_rotations: FloatArray) -> FloatArray:
        """Return the movers' numbers (n + m, 20) as in `movers`, with velocities 0; arguments as for `place`."""
        rotations = geom_rotations.reshape(-1, 3, 3)
        numbers: FloatArray = np.empty((self._count + len(self._things), NUMBERS))
        for kind, mine, of_kind in self._groups:
            positions_m = geom_positions_m[of_kind.geoms] + offsets_m[of_kind.owners]
            numbers[mine] = kind.placed(of_kind.sizes, positions_m, rotations[of_kind.geoms])
        poses = geom_positions_m[self._first_geoms] + offsets_m[self._things], rotations[self._first_geoms]
        numbers[self._count :] = rows(*poses, width=NUMBERS)
        return numbers


def _primitive_kind(model: Any, geom: int) -> str | None:
    kind = int(model.geom_type[geom])
    if kind == GeomKind.MESH:
        # Four vertices without four faces are an open surface.
        mesh = model.geom_dataid[geom]
        return "tetrahedron" if model.mesh_vertnum[mesh] == 4 and model.mesh_facenum[mesh] == 4 else None
    return _EXACT.get(GeomKind(kind)) if kind in set(GeomKind) else None


def _meshes(
    model: Any, geoms: Sequence[int]
) -> tuple["MeshLibrary | None", dict[int, tuple[int, "GeomMesh"]], frozenset[int]]:
    """Return the library, the (mesh index, mesh) of each geom that has a mesh, and the geoms that have none."""
    candidates = [geom for geom in geoms if int(model.geom_type[geom]) in _MESHES]
    if not candidates:
        return None, {}, frozenset(geoms)
    # A scene without meshes does not load the kernels for them.
    from robot_side.drivers.mujoco.geom_meshes import GeomMeshes  # noqa: PLC0415

    shapes = GeomMeshes(model)
    found = {geom: shape for geom in candidates if (shape := shapes.add(geom)) is not None}
    return shapes.mesh_library(), found, frozenset(geoms) - found.keys()
