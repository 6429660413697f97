"""What a camera sees of the simulated world, wrong by its own error (eq. 1-2)."""

import math
from dataclasses import replace

import numpy as np

from common.arrays import FloatArray
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.objects.velocities import ObjectVelocities
from robot_side.simulation.camera_error import CameraError
from robot_side.simulation.scene import Scene


class MujocoCamera:
    """An ObjectSource: the simulated objects as a camera with segmentation reports them, frame by frame."""

    def __init__(self, scene: Scene, error: CameraError | None = None, frame_rate_hz: float = 30.0) -> None:
        """Look at `scene` with `error`, drawn for its objects' names in their order; no error when None."""
        if not (math.isfinite(frame_rate_hz) and frame_rate_hz > 0.0):
            raise ValueError(f"frame_rate_hz = {frame_rate_hz}; valid: finite and above 0")
        self._scene = scene
        self._error = error or CameraError(tuple(thing.name for thing in scene.objects))
        self._period_s = 1.0 / frame_rate_hz
        self._origin_s: float | None = None
        self._frame_number = -1
        self._newest: PerceivedObjects | None = None
        self._velocities = ObjectVelocities()
        self._first_geoms = np.array([thing.geoms[0] for thing in scene.objects], dtype=np.int64)

    def perceive(self, now_s: float) -> PerceivedObjects:
        """The newest frame at `now_s`; the same object is returned until a newer frame is there."""
        if self._origin_s is None:
            self._origin_s = now_s
        # A frame is due on the grid of the first one, so that the rate does not sink with the tick's period.
        number = math.floor((now_s - self._origin_s) / self._period_s + 1e-9)
        if self._newest is None or number > self._frame_number:
            self._frame_number = number
            self._newest = self._frame(now_s)
        return self._newest

    def _frame(self, now_s: float) -> PerceivedObjects:
        scene, offsets_m = self._scene, self._error.next_frame()
        seen = scene.primitives.place(now_s, scene.roles, offsets_m, scene.data.geom_xpos, scene.data.geom_xmat)
        positions_m: FloatArray = scene.data.geom_xpos[self._first_geoms] + offsets_m
        return replace(seen, velocities_m_s=self._velocities.see(now_s, positions_m))

    def set_role(self, name: str, role: Role) -> None:
        """Change what the object `name` is to the task, from the next frame on. ValueError for an unknown name."""
        if name not in self._scene.roles:
            raise ValueError(f"name = {name!r} is no object; valid: {', '.join(self._scene.roles)}")
        self._scene.roles[name] = role
