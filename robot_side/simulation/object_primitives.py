"""The primitives of a scene's objects: which geoms are spheres, boxes, tetrahedra and half-spaces, and where."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.perceived_objects import PerceivedObjects, Role
from robot_side.simulation.model_enums import GeomKind


@dataclass(frozen=True)
class SceneObject:
    """A thing in the scene that is not the robot: one tree of bodies, or one geom that is fixed to the world."""

    name: str
    geoms: tuple[int, ...]
    """Those that can touch something."""


class ObjectPrimitives:
    """The objects' shapes in their geoms' frames, ready to be placed in the world once for each frame.

    A sphere, a box, a plane and a mesh of four vertices are exact. Any other shape stands for its bounding box,
    which contains it, and its object is named in `approximated`.
    """

    def __init__(self, model: Any, objects: Sequence[SceneObject]) -> None:
        """Read the shapes of `objects` from a compiled MuJoCo model."""
        self._names = tuple(thing.name for thing in objects)
        geoms = [(geom, index) for index, thing in enumerate(objects) for geom in thing.geoms]
        of_kind: dict[str, list[tuple[int, int]]] = {"sphere": [], "box": [], "tetrahedron": [], "plane": []}
        approximated: dict[str, None] = {}
        for geom, index in geoms:
            kind = _primitive_kind(model, geom)
            of_kind[kind or "box"].append((geom, index))
            if kind is None:
                approximated[self._names[index]] = None
        self.approximated = tuple(approximated)
        """Names of the objects that are seen larger than they are."""

        self._sphere_geoms, self._sphere_object = _columns(of_kind["sphere"])
        self._radii_m: FloatArray = model.geom_size[self._sphere_geoms, 0].copy()
        self._box_geoms, self._box_object = _columns(of_kind["box"])
        self._box_offsets_m: FloatArray = model.geom_aabb[self._box_geoms, :3].copy()
        self._box_half_sizes_m: FloatArray = model.geom_aabb[self._box_geoms, 3:].copy()
        self._tetrahedron_geoms, self._tetrahedron_object = _columns(of_kind["tetrahedron"])
        self._corners_m: FloatArray = np.array(
            [_mesh_vertices(model, int(geom)) for geom in self._tetrahedron_geoms], dtype=np.float64
        ).reshape(-1, 4, 3)
        self._plane_geoms, self._plane_object = _columns(of_kind["plane"])

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
        spheres = seen[self._sphere_object]
        boxes = seen[self._box_object]
        tetrahedra = seen[self._tetrahedron_object]
        planes = seen[self._plane_object]

        def position(geoms: IntArray, objects: IntArray) -> FloatArray:
            return geom_positions_m[geoms] + offsets_m[objects]

        def rotation(geoms: IntArray) -> FloatArray:
            return geom_rotations[geoms].reshape(-1, 3, 3)

        box_rotations = rotation(self._box_geoms[boxes])
        tetrahedron_centers = position(self._tetrahedron_geoms[tetrahedra], self._tetrahedron_object[tetrahedra])
        tetrahedron_rotations = rotation(self._tetrahedron_geoms[tetrahedra])
        normals = np.ascontiguousarray(rotation(self._plane_geoms[planes])[:, :, 2])
        plane_points = position(self._plane_geoms[planes], self._plane_object[planes])
        return PerceivedObjects(
            time_s=time_s,
            names=self._names,
            roles=tuple(roles[name] for name in self._names),
            sphere_centers_m=position(self._sphere_geoms[spheres], self._sphere_object[spheres]),
            sphere_radii_m=self._radii_m[spheres],
            sphere_object=self._sphere_object[spheres],
            box_centers_m=position(self._box_geoms[boxes], self._box_object[boxes])
            + np.einsum("bij,bj->bi", box_rotations, self._box_offsets_m[boxes]),
            box_rotations=box_rotations,
            box_half_sizes_m=self._box_half_sizes_m[boxes],
            box_object=self._box_object[boxes],
            tetrahedron_vertices_m=tetrahedron_centers[:, None, :]
            + np.einsum("tij,tvj->tvi", tetrahedron_rotations, self._corners_m[tetrahedra]),
            tetrahedron_object=self._tetrahedron_object[tetrahedra],
            half_space_normals=normals,
            half_space_offsets_m=np.einsum("pi,pi->p", normals, plane_points),
            half_space_object=self._plane_object[planes],
        )


def _primitive_kind(model: Any, geom: int) -> str | None:
    kind = int(model.geom_type[geom])
    exact = {GeomKind.SPHERE: "sphere", GeomKind.BOX: "box", GeomKind.PLANE: "plane"}
    if kind == GeomKind.MESH and model.mesh_vertnum[model.geom_dataid[geom]] == 4:
        return "tetrahedron"
    return exact.get(GeomKind(kind)) if kind in set(GeomKind) else None


def _mesh_vertices(model: Any, geom: int) -> FloatArray:
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_vertadr[mesh])
    vertices: FloatArray = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].astype(np.float64)
    return vertices


def _columns(pairs: list[tuple[int, int]]) -> tuple[IntArray, IntArray]:
    both = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return both[:, 0].copy(), both[:, 1].copy()
