"""Shapes of a scene's links and objects, from MuJoCo's geoms, for drawing."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray, IntArray
from common.protocol.view_messages import Shape, ShapeKind
from robot_side.drivers.mujoco.mesh_arrays import height_field_surface, mesh_triangles, mesh_vertices
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.scene import Scene
from robot_side.surroundings.perceived import PerceivedObjects

_KINDS: Final[dict[GeomKind, ShapeKind]] = {
    GeomKind.PLANE: "plane",
    GeomKind.SPHERE: "sphere",
    GeomKind.CAPSULE: "capsule",
    GeomKind.ELLIPSOID: "ellipsoid",
    GeomKind.CYLINDER: "cylinder",
    GeomKind.BOX: "box",
}
_SHOWN_GROUPS: Final = 3
"""How many geom groups MuJoCo's viewers show; collision shapes that visual ones hide are in later groups."""
_SIZES: Final = {"sphere": 1, "capsule": 2, "cylinder": 2, "plane": 2, "box": 3, "ellipsoid": 3}
"""How many of a geom's three sizes its kind uses"""


IN_PLACE: Final = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


class SceneModel:
    """Links and objects of a scene, and their shapes in their own frames."""

    surfaces = 0
    """Number of objects, the first ones of each frame, that are surfaces which come and go: they have no shapes"""

    def __init__(self, scene: Scene, fixed: PerceivedObjects | None = None) -> None:
        """fixed: objects that each frame has behind the scene's own; of these, boxes are drawn."""
        model, robot = scene.model, scene.robot
        self._fixed = fixed
        of_robot = np.flatnonzero(model.body_rootid[model.geom_bodyid] == robot.root_body)
        shown = of_robot[model.geom_group[of_robot] < _SHOWN_GROUPS]
        self._link_geoms = shown if shown.size else of_robot
        self.bodies: IntArray = np.unique(model.geom_bodyid[self._link_geoms]).astype(np.int64)
        """(n,) bodies of the robot's links"""
        self.links = tuple(model.body(int(body)).name or f"body{body}" for body in self.bodies)
        of_scene = tuple(thing.name for thing in scene.objects)
        self.objects = of_scene + (() if fixed is None else fixed.names)
        self.may_move: IntArray = np.array(
            [index for index, name in enumerate(of_scene) if name not in scene.fixed], dtype=np.int64
        )
        """Indices of the objects that a joint or a mocap body can move"""
        self._model = model
        self._geoms = [thing.geoms for thing in scene.objects]
        self._start = scene.data.geom_xpos.copy(), scene.data.geom_xmat.reshape(-1, 3, 3).copy()

    def update(self, objects: PerceivedObjects) -> bool:
        """Return whether a frame has other objects than before: never, because a scene's objects stay the same."""
        del objects
        return False

    def link_shapes(self) -> Iterator[Shape]:
        """Yield the shapes of the robot, each in the frame of its body."""
        model, owners = self._model, {int(body): index for index, body in enumerate(self.bodies)}
        for geom in self._link_geoms:
            owner = owners[int(model.geom_bodyid[geom])]
            yield self._shape(int(geom), owner, True, model.geom_pos[geom], model.geom_quat[geom])

    def object_shapes(self, index: int) -> Iterator[Shape]:
        """Yield the shapes of one object, in the frame of its first geom; joints inside keep their start positions."""
        if (beyond := index - len(self._geoms)) >= 0:
            sizes = (
                [] if self._fixed is None else self._fixed.box_half_sizes_m[self._fixed.box_object == beyond].tolist()
            )
            for size in sizes:
                yield Shape(index, False, "box", (size[0], size[1], size[2]), IN_PLACE)
            return
        positions_m, rotations = self._start
        first = self._geoms[index][0]
        yield self._shape(first, index, False, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        for geom in self._geoms[index][1:]:
            position_m = rotations[first].T @ (positions_m[geom] - positions_m[first])
            turned = Rotation.from_matrix(rotations[first].T @ rotations[geom]).as_quat(scalar_first=True)
            yield self._shape(geom, index, False, position_m, turned)

    def _shape(self, geom: int, owner: int, of_robot: bool, position_m: FloatArray, quaternion: FloatArray) -> Shape:
        model = self._model
        pose = (*position_m.tolist(), *quaternion.tolist())
        color = tuple(_color(model, geom).tolist())
        number = int(model.geom_type[geom])
        kind = _KINDS.get(GeomKind(number)) if number in set(GeomKind) else "box"
        if kind is not None:
            size = model.geom_aabb[geom, 3:] if number not in set(GeomKind) else model.geom_size[geom]
            known = _SIZES[kind]
            size_m = tuple(size[:known].tolist() + [0.0] * (3 - known))
            return Shape(owner, of_robot, kind, size_m, pose, color)
        vertices_m, triangles = (
            height_field_surface(model, geom)
            if number == GeomKind.HFIELD
            else (mesh_vertices(model, geom), mesh_triangles(model, geom))
        )
        return Shape(
            *(owner, of_robot, "mesh", (1.0, 1.0, 1.0), pose, color),
            vertices_m=vertices_m.astype("<f4").tobytes(),
            triangles=triangles.astype("<u4").tobytes(),
        )


def bytes_of(shape: Shape) -> int:
    """Return an upper bound of the bytes that a shape takes in a message."""
    return len(shape.vertices_m) + len(shape.triangles) + 160


def _color(model: Any, geom: int) -> FloatArray:
    material = int(model.geom_matid[geom])
    color: FloatArray = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    return color.astype(np.float64)
