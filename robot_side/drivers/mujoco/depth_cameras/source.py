"""Source of objects by simulated depth cameras."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.roles import Role
from robot_side.depth.frames import SurfaceFrames
from robot_side.depth.picture import SOLID_NUMBERS
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.scene import Scene
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.tick.events import Listener, Tick

_SOON_S: Final = 1e-9


class SimulatedDepth(Listener):
    """Source of objects: surfaces that simulated depth cameras see, in the time of the caller."""

    def __init__(self, scene: Scene, make: Callable[[], DepthRig], frames: Callable[[], SurfaceFrames]) -> None:
        """make: makes the cameras, when they are first needed. frames: makes empty frames."""
        self._scene, self._make, self._new_frames = scene, make, frames
        self._rig: DepthRig | None = None
        self._frames = frames()
        self._number, self._origin_s = -1, 0.0
        self._solids: FloatArray = np.empty((0, SOLID_NUMBERS))

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`; its pictures were taken by the cameras' latency before."""
        if self._rig is None:
            self._rig, self._origin_s = self._make(), now_s
        self._rig.explain(self._solids)
        number = math.floor((now_s - self._origin_s) * self._rig.rate_hz + _SOON_S)
        if number > self._number:
            self._number = number
            self._rig.take(self._scene.data, now_s, self._scene.roles)
        if (news := self._rig.arrived(now_s)) is not None:
            changes, taken_s = news
            self._frames.take(changes, (taken_s, taken_s), self._rig.unknown())
        return self._frames.at(now_s)

    def explain(self, solids: FloatArray) -> None:
        """Take solids (k, 16) of known models out of the map, from the next picture on."""
        self._solids = solids

    def on_tick(self, tick: Tick) -> None:
        """Take what the gripper holds."""
        if self._rig is not None and tick.found is not None:
            self._rig.hold(tick.found.held)

    def put_back(self) -> None:
        """Forget what was seen, as the objects were put back."""
        if self._rig is not None:
            self._rig.restart()
            self._frames = self._new_frames()

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of the object `name` from the next frame on."""
        if self._rig is not None:
            self._rig.perception.set_role(name, role)
