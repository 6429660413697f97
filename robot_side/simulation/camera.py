"""What a camera sees of the simulated world, wrong by its own error (eq. 1-2)."""

import math
import zlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.simulation.object_primitives import ObjectPrimitives
from robot_side.simulation.scene import Scene
from robot_side.surroundings.movers import Movers
from robot_side.surroundings.perceived import PerceivedObjects, Role
from robot_side.surroundings.velocities import ObjectVelocities

_FRAME_PERIOD_S = 1.0 / 30.0


class CameraError:
    """The error e_c ~ N(μ_c, σ_c²) per axis of each object's position (eq. 1-2), world frame: perceived = true - e_c.

    One part stays with the object for the whole run, as a calibration or segmentation error does; an optional
    part with mean 0 is drawn anew in each frame. What an object gets depends on the seed and its own name
    alone, so that adding or removing other objects changes nothing.
    """

    def __init__(
        self,
        names: tuple[str, ...],
        mean_m: float | tuple[float, float, float] = 0.0,
        standard_deviation_m: float = 0.0,
        frame_standard_deviation_m: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Draw the lasting part for `names` (k); mean_m: of every axis, or of each."""
        self.mean_m: FloatArray = np.broadcast_to(np.asarray(mean_m, dtype=np.float64), (3,)).copy()
        """(3,) μ_c"""
        self.variance_m2 = standard_deviation_m**2 + frame_standard_deviation_m**2
        """σ_c² of eq. 2 for a single frame: both parts together."""
        self._frame_standard_deviation_m = frame_standard_deviation_m
        generators = [np.random.default_rng([seed, zlib.crc32(name.encode())]) for name in names]
        self._lasting = self.mean_m + standard_deviation_m * _draw(generators)
        self._generators = [] if self.lasts else generators
        self._offsets = -self._lasting

    @property
    def lasts(self) -> bool:
        """Whether it is the same in all frames."""
        return self._frame_standard_deviation_m == 0.0

    def next_frame(self) -> FloatArray:
        """Offsets -e_c (k, 3) to add to the true positions in the next frame, metres, in the order of the names."""
        if self.lasts:
            return self._offsets
        offsets: FloatArray = -(self._lasting + self._frame_standard_deviation_m * _draw(self._generators))
        return offsets


def _draw(generators: Sequence[np.random.Generator]) -> FloatArray:
    draws: FloatArray = np.array([generator.standard_normal(3) for generator in generators])
    return draws.reshape(-1, 3)


class MujocoCamera:
    """An ObjectSource: the simulated objects as a camera with segmentation reports them, frame by frame."""

    def __init__(self, scene: Scene, error: CameraError | None = None) -> None:
        """Look at `scene` with `error`, drawn for its objects' names in their order; no error when None."""
        self._scene = scene
        self._error = error or CameraError(tuple(thing.name for thing in scene.objects))
        self._origin_s: float | None = None
        self._frame_number = -1
        self._newest: PerceivedObjects | None = None
        self._velocities = ObjectVelocities()
        fixed = scene.fixed if self._error.lasts else frozenset()
        self._things = np.array([k for k, thing in enumerate(scene.objects) if thing.name not in fixed], dtype=np.int64)
        """What may be elsewhere in the next frame"""
        self._moving = scene.primitives.only(self._things)
        self._first_geoms = np.array([thing.geoms[0] for thing in scene.objects], dtype=np.int64)
        self._movers: Movers | None = None
        self._roles: tuple[Role, ...] = ()

    def perceive(self, now_s: float) -> PerceivedObjects:
        """The newest frame at `now_s`; the same object is returned until a newer frame is there."""
        if self._origin_s is None:
            self._origin_s = now_s
        # A frame is due on the grid of the first one, so that the rate does not sink with the tick's period.
        number = math.floor((now_s - self._origin_s) / _FRAME_PERIOD_S + 1e-9)
        if self._newest is None or number > self._frame_number:
            self._frame_number = number
            self._newest = self._frame(now_s)
        return self._newest

    def _frame(self, now_s: float) -> PerceivedObjects:
        scene, things, offsets_m = self._scene, self._things, self._error.next_frame()
        geoms = self._first_geoms[things]
        velocities_m_s = self._velocities.see(now_s, scene.data.geom_xpos[geoms] + offsets_m[things])
        if self._movers is None:
            everywhere: FloatArray = np.zeros((len(scene.objects), 3))
            everywhere[things] = velocities_m_s
            whole = self._seen(now_s, scene.primitives, offsets_m, self._first_geoms, everywhere)
            self._movers, self._roles = Movers(whole, things), whole.roles
            return whole
        moved = self._seen(now_s, self._moving, offsets_m[things], geoms, velocities_m_s)
        return self._movers.frame(moved, self._roles)

    def _seen(
        self,
        now_s: float,
        primitives: ObjectPrimitives,
        offsets_m: FloatArray,
        first_geoms: IntArray,
        velocities_m_s: FloatArray,
    ) -> PerceivedObjects:
        """The objects of `primitives` now."""
        data = self._scene.data
        return replace(
            primitives.place(now_s, self._scene.roles, offsets_m, data.geom_xpos, data.geom_xmat),
            positions_m=data.geom_xpos[first_geoms] + offsets_m,
            rotations=data.geom_xmat[first_geoms].reshape(-1, 3, 3),
            velocities_m_s=velocities_m_s,
        )

    def set_role(self, name: str, role: Role) -> None:
        """Change what the object `name` is to the task, from the next frame on. ValueError for an unknown name."""
        roles = self._scene.roles
        if name not in roles:
            raise ValueError(f"name = {name!r} is no object; valid: {', '.join(roles)}")
        if Role.IGNORED in (role, roles[name]):
            # Other primitives are there from now on.
            self._movers = None
        roles[name] = role
        self._roles = tuple(roles[thing.name] for thing in self._scene.objects)
