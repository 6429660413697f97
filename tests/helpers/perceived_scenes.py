"""Small scenes of perceived objects, for tests of the robot side."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from common.roles import Role
from robot_side.overlap import Mesh, MeshLibrary
from robot_side.overlap.meshes.mesh_shapes import ellipsoid_mesh
from robot_side.surroundings.perceived import PerceivedObjects

# A cube's corners, numbered by their bits (x, y, z), and five tetrahedra that fill it.
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
_FIVE_TETRAHEDRA = np.array([[0, 4, 2, 1], [6, 4, 2, 7], [5, 4, 1, 7], [3, 2, 1, 7], [4, 2, 1, 7]])


class Scene:
    """Builder of perceived objects: `add` begins an object, and the other methods add primitives to it."""

    def __init__(self) -> None:
        self.roles: list[Role] = []
        self._spheres: list[tuple[npt.ArrayLike, float, int]] = []
        self._boxes: list[tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike, int]] = []
        self._tetrahedra: list[tuple[npt.ArrayLike, int]] = []
        self._ellipsoids: list[tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike, int]] = []
        self._half_spaces: list[tuple[npt.ArrayLike, float, int]] = []
        self._meshes: list[tuple[int, npt.ArrayLike, npt.ArrayLike, int]] = []
        self._shapes: list[Mesh] = []

    def add(self, role: Role = Role.OBSTACLE) -> "Scene":
        """Begin a new object, to which the next primitives belong."""
        self.roles.append(role)
        return self

    def sphere(self, center_m: npt.ArrayLike, radius_m: float) -> "Scene":
        self._spheres.append((center_m, radius_m, len(self.roles) - 1))
        return self

    def box(self, center_m: npt.ArrayLike, half_sizes_m: npt.ArrayLike, rotation: FloatArray | None = None) -> "Scene":
        self._boxes.append((center_m, np.eye(3) if rotation is None else rotation, half_sizes_m, len(self.roles) - 1))
        return self

    def tetrahedron(self, vertices_m: npt.ArrayLike) -> "Scene":
        self._tetrahedra.append((vertices_m, len(self.roles) - 1))
        return self

    def box_of_tetrahedra(self, center_m: FloatArray, half_sizes_m: FloatArray, rotation: FloatArray) -> "Scene":
        corners = center_m + (_CORNERS * half_sizes_m) @ rotation.T
        for indices in _FIVE_TETRAHEDRA:
            self.tetrahedron(corners[indices])
        return self

    def mesh(self, mesh: Mesh, position_m: npt.ArrayLike, rotation: FloatArray | None = None) -> "Scene":
        if mesh not in self._shapes:
            self._shapes.append(mesh)
        rows = self._shapes.index(mesh), position_m, np.eye(3) if rotation is None else rotation
        self._meshes.append((*rows, len(self.roles) - 1))
        return self

    def ellipsoid(
        self, center_m: npt.ArrayLike, half_axes_m: npt.ArrayLike, rotation: FloatArray | None = None
    ) -> "Scene":
        turned = np.eye(3) if rotation is None else rotation
        self._ellipsoids.append((center_m, turned, half_axes_m, len(self.roles) - 1))
        return self

    def half_space(self, normal: npt.ArrayLike, offset_m: float) -> "Scene":
        self._half_spaces.append((normal, offset_m, len(self.roles) - 1))
        return self

    def objects(self) -> PerceivedObjects:
        return PerceivedObjects(
            time_s=0.0,
            names=tuple(f"object{index}" for index in range(len(self.roles))),
            roles=tuple(self.roles),
            sphere_centers_m=_stacked([row[0] for row in self._spheres], (3,)),
            sphere_radii_m=_stacked([row[1] for row in self._spheres], ()),
            sphere_object=np.array([row[-1] for row in self._spheres], dtype=np.int64),
            box_centers_m=_stacked([row[0] for row in self._boxes], (3,)),
            box_rotations=_stacked([row[1] for row in self._boxes], (3, 3)),
            box_half_sizes_m=_stacked([row[2] for row in self._boxes], (3,)),
            box_object=np.array([row[-1] for row in self._boxes], dtype=np.int64),
            tetrahedron_vertices_m=_stacked([row[0] for row in self._tetrahedra], (4, 3)),
            tetrahedron_object=np.array([row[-1] for row in self._tetrahedra], dtype=np.int64),
            ellipsoid_centers_m=_stacked([row[0] for row in self._ellipsoids], (3,)),
            ellipsoid_rotations=_stacked([row[1] for row in self._ellipsoids], (3, 3)),
            ellipsoid_half_axes_m=_stacked([row[2] for row in self._ellipsoids], (3,)),
            ellipsoid_object=np.array([row[-1] for row in self._ellipsoids], dtype=np.int64),
            half_space_normals=_stacked([row[0] for row in self._half_spaces], (3,)),
            half_space_offsets_m=_stacked([row[1] for row in self._half_spaces], ()),
            half_space_object=np.array([row[-1] for row in self._half_spaces], dtype=np.int64),
            mesh_library=MeshLibrary(self._shapes) if self._shapes else None,
            mesh_index=np.array([row[0] for row in self._meshes], dtype=np.int64),
            mesh_positions_m=_stacked([row[1] for row in self._meshes], (3,)),
            mesh_rotations=_stacked([row[2] for row in self._meshes], (3, 3)),
            mesh_object=np.array([row[-1] for row in self._meshes], dtype=np.int64),
        )


def random_rotation(rng: np.random.Generator) -> FloatArray:
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation: FloatArray = matrix * np.sign(np.linalg.det(matrix))
    return rotation


def random_scene(
    rng: np.random.Generator, of_each_kind: int, extent_m: float = 1.0, meshes: int = 0
) -> PerceivedObjects:
    """Return `of_each_kind` spheres, boxes, tetrahedra and half-spaces, and `meshes` meshes, each as one object.

    Their centres are at random within ±`extent_m` on each axis.
    """
    scene = Scene()
    for _ in range(of_each_kind):
        center = rng.uniform(-extent_m, extent_m, 3)
        scene.add().sphere(center, float(rng.uniform(0.01, 0.2)))
        center = rng.uniform(-extent_m, extent_m, 3)
        scene.add().box(center, rng.uniform(0.01, 0.2, 3), random_rotation(rng))
        scene.add().tetrahedron(rng.uniform(-extent_m, extent_m, 3) + rng.normal(size=(4, 3)) * 0.1)
        normal = rng.normal(size=3)
        scene.add().half_space(normal / np.linalg.norm(normal), float(rng.uniform(-extent_m, extent_m)))
    shapes = [Mesh(*ellipsoid_mesh(rng.uniform(0.03, 0.2, 3), 3)[:2]) for _ in range(min(meshes, 3))]
    for number in range(meshes):
        position = rng.uniform(-extent_m, extent_m, 3)
        scene.add().mesh(shapes[number % len(shapes)], position, random_rotation(rng))
    return scene.objects()


def _stacked(rows: Sequence[npt.ArrayLike], shape: tuple[int, ...]) -> FloatArray:
    return np.array(rows, dtype=np.float64).reshape(len(rows), *shape)
