"""Shapes of a perception process's objects, for drawing; they may change from frame to frame."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from common.protocol.view_messages import Shape
from robot_side.drivers.mujoco.scene import Scene
from robot_side.surroundings.fixed_objects import SIDES
from robot_side.surroundings.perceived import KINDS, PerceivedObjects
from robot_side.viewing.shapes import IN_PLACE, SceneModel

_SIZES: Final = {"sphere": "sphere_radii_m", "box": "box_half_sizes_m", "ellipsoid": "ellipsoid_half_axes_m"}
_CORNERS: Final = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], dtype="<u4")


class PerceivedModel(SceneModel):
    """Links of a scene's robot, and objects of the newest frame."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._frame: PerceivedObjects | None = None
        self._known: tuple[object, ...] = ()

    def update(self, objects: PerceivedObjects) -> bool:
        """Take a frame's objects; return whether the objects or their shapes differ from the last frame's."""
        if objects is self._frame:
            return False
        arrays = [*(kind.owner for kind in KINDS), *_SIZES.values(), "mesh_index"]
        known = objects.names, objects.mesh_library, *(getattr(objects, name).tobytes() for name in arrays)
        self._frame = objects
        if known == self._known:
            return False
        self._known, self.objects = known, objects.names
        self.may_move = np.arange(len(objects.names))
        return True

    def object_shapes(self, index: int) -> Iterator[Shape]:
        """Yield the shapes of one object, in the object's frame."""
        frame = self._frame
        if frame is None or frame.positions_m is None or frame.rotations is None:
            return
        for kind, name in _SIZES.items():
            for size in getattr(frame, name)[getattr(frame, f"{kind}_object") == index]:
                x, y, z = [*np.atleast_1d(size).tolist(), 0.0, 0.0][:3]
                yield Shape(index, False, kind, (x, y, z), IN_PLACE)  # type: ignore[arg-type]
        # The sides of the workspace would cover all else.
        if index in frame.half_space_object and frame.names[index] not in SIDES:
            yield Shape(index, False, "plane", (0.0, 0.0, 0.0), IN_PLACE)
        for corners in frame.tetrahedron_vertices_m[frame.tetrahedron_object == index]:
            own = (corners - frame.positions_m[index]) @ frame.rotations[index]
            # Anticlockwise as seen from outside, for either orientation of the corners.
            triangles = _CORNERS if np.linalg.det(own[1:] - own[0]) < 0.0 else _CORNERS[:, ::-1]
            yield Shape(
                *(index, False, "mesh", (1.0, 1.0, 1.0), IN_PLACE),
                vertices_m=own.astype("<f4").tobytes(),
                triangles=triangles.tobytes(),
            )
        placed = frame.mesh_index[frame.mesh_object == index]
        for corners in [] if frame.mesh_library is None else [frame.mesh_library.corners_m[mesh] for mesh in placed]:
            yield Shape(
                *(index, False, "mesh", (1.0, 1.0, 1.0), IN_PLACE),
                vertices_m=corners.astype("<f4").tobytes(),
                triangles=np.arange(3 * len(corners), dtype="<u4").tobytes(),
            )
