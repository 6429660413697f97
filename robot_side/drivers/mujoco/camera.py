"""Simulated camera that perceives the scene's objects with an error (eq. 1-2)."""

import math
import zlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from common.arrays import FloatArray
from common.roles import Role
from robot_side.drivers.mujoco.object_primitives import MovingPrimitives
from robot_side.drivers.mujoco.scene import Scene
from robot_side.surroundings.kinds.layout import VELOCITY
from robot_side.surroundings.movers import Movers
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.velocities import ObjectVelocities

_FRAME_PERIOD_S = 1.0 / 30.0


class CameraError:
    """Error e_c ~ N(μ_c, σ_c²) of each object's position, per axis, world frame: perceived = true - e_c (eq. 1-2).

    One part lasts for the whole run, like an error of calibration or segmentation. An optional part with mean 0 is
    drawn anew in each frame. An object's error depends only on the seed and its name, so that other objects do not
    change it.
    """

    def __init__(
        self,
        names: tuple[str, ...],
        mean_m: float | tuple[float, float, float] = 0.0,
        standard_deviation_m: float = 0.0,
        frame_standard_deviation_m: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Draw the lasting part for the objects `names` (k); mean_m: one value for all axes, or one for each."""
        self.mean_m: FloatArray = np.broadcast_to(np.asarray(mean_m, dtype=np.float64), (3,)).copy()
        """(3,) mean error μ_c"""
        self.variance_m2 = standard_deviation_m**2 + frame_standard_deviation_m**2
        """Variance σ_c² of eq. 2 for a single frame, of both parts together"""
        self._frame_standard_deviation_m = frame_standard_deviation_m
        generators = [np.random.default_rng([seed, zlib.crc32(name.encode())]) for name in names]
        self._lasting = self.mean_m + standard_deviation_m * _draw(generators)
        self._generators = [] if self.lasts else generators
        self._offsets = -self._lasting

    @property
    def lasts(self) -> bool:
        """Whether the error is the same in all frames"""
        return self._frame_standard_deviation_m == 0.0

    def next_frame(self) -> FloatArray:
        """Return the offsets -e_c (k, 3) in m, by `names`, to be added to the true positions in the next frame."""
        if self.lasts:
            return self._offsets
        offsets: FloatArray = -(self._lasting + self._frame_standard_deviation_m * _draw(self._generators))
        return offsets


def _draw(generators: Sequence[np.random.Generator]) -> FloatArray:
    draws: FloatArray = np.array([generator.standard_normal(3) for generator in generators])
    return draws.reshape(-1, 3)


class MujocoCamera:
    """Source of perceived objects: the simulated objects as a camera with segmentation reports them, frame by frame."""

    def __init__(self, scene: Scene, error: CameraError | None = None) -> None:
        """Observe `scene` with `error`, which was drawn for the names of its objects in their order; None: no error."""
        self._scene = scene
        self._error = error or CameraError(tuple(thing.name for thing in scene.objects))
        self._origin_s: float | None = None
        self._frame_number = -1
        self._newest: PerceivedObjects | None = None
        self._velocities = ObjectVelocities()
        fixed = scene.fixed if self._error.lasts else frozenset()
        self._things = np.array([k for k, thing in enumerate(scene.objects) if thing.name not in fixed], dtype=np.int64)
        """Indices of the objects whose perceived poses may differ in the next frame"""
        self._first_geoms = np.array([thing.geoms[0] for thing in scene.objects], dtype=np.int64)
        self._moving: tuple[Movers, MovingPrimitives] | None = None
        self._roles: tuple[Role, ...] = ()

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`: the same object until there is a newer frame."""
        if self._origin_s is None:
            self._origin_s = now_s
        # Frames are due on the first one's time grid, so that the tick's period does not reduce the rate.
        number = math.floor((now_s - self._origin_s) / _FRAME_PERIOD_S + 1e-9)
        if self._newest is None or number > self._frame_number:
            self._frame_number = number
            self._newest = self._frame(now_s)
        return self._newest

    def put_back(self) -> None:
        """Forget the frames so far, as the objects were put back: a jump is no motion."""
        self._newest, self._velocities = None, ObjectVelocities()

    def _frame(self, now_s: float) -> PerceivedObjects:
        data, offsets_m = self._scene.data, self._error.next_frame()
        if self._moving is None:
            return self._whole(now_s, offsets_m)
        movers, primitives = self._moving
        numbers = primitives.numbers(offsets_m, data.geom_xpos, data.geom_xmat)
        of_objects = numbers[len(numbers) - len(self._things) :]
        of_objects[:, VELOCITY : VELOCITY + 3] = self._velocities.see(now_s, of_objects[:, :3].copy())
        return movers.frame(now_s, numbers, self._roles)

    def _whole(self, now_s: float, offsets_m: FloatArray) -> PerceivedObjects:
        """Return a complete frame of all objects; later frames update only the objects that may move."""
        scene, data, things = self._scene, self._scene.data, self._things
        positions_m = data.geom_xpos[self._first_geoms] + offsets_m
        velocities_m_s: FloatArray = np.zeros((len(scene.objects), 3))
        velocities_m_s[things] = self._velocities.see(now_s, positions_m[things])
        whole = replace(
            scene.primitives.perceived(now_s, scene.roles, offsets_m, data.geom_xpos, data.geom_xmat),
            positions_m=positions_m,
            rotations=data.geom_xmat[self._first_geoms].reshape(-1, 3, 3),
            velocities_m_s=velocities_m_s,
        )
        self._moving = Movers(whole, things), scene.primitives.moving(things, scene.roles)
        self._roles = whole.roles
        return whole

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of the object `name` from the next frame on; ValueError for an unknown name."""
        roles = self._scene.roles
        if name not in roles:
            raise ValueError(f"name = {name!r} is no object; valid: {', '.join(roles)}")
        if Role.IGNORED in (role, roles[name]):
            # The set of primitives changes.
            self._moving = None
        roles[name] = role
        self._roles = tuple(roles[thing.name] for thing in self._scene.objects)
