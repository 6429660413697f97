"""Many objects that a camera perceives, and that no physics knows: around the table, out of the gripper's way."""

from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.objects.perceived import ObjectSource, PerceivedObjects, Role

MIDDLE_M: Final = (0.55, 0.0, 0.25)
"""Of the built-in table's things."""
NEAREST_M, FARTHEST_M = 0.6, 3.0
_SIZES_M: Final = (0.005, 0.03)
_FASTEST_M_S: Final = 0.2
_KINDS: Final = ("spheres", "boxes", "tetrahedra")


@dataclass(frozen=True)
class Crowd:
    """Random objects of one primitive each, evenly in directions and distances."""

    count: int
    moving: int = 0
    kind: str = "mixed"
    seed: int = 1
    centers_m: FloatArray = field(init=False)
    """(n, 3) at the time 0"""
    radii_m: FloatArray = field(init=False)
    """(n,) of a sphere around each"""
    kinds: IntArray = field(init=False)
    """(n,) into spheres, boxes, tetrahedra"""

    def __post_init__(self) -> None:
        if self.kind not in (*_KINDS, "mixed"):
            raise ValueError(f"--kind {self.kind}: valid: mixed, {', '.join(_KINDS)}")
        if not 0 <= self.moving <= self.count:
            raise ValueError(f"--moving {self.moving}: valid: 0 to --objects")
        generator = np.random.default_rng(self.seed)
        away = generator.normal(size=(self.count, 3))
        away /= np.linalg.norm(away, axis=1)[:, None]
        apart_m = generator.uniform(NEAREST_M, FARTHEST_M, self.count)
        object.__setattr__(self, "centers_m", MIDDLE_M + apart_m[:, None] * away)
        object.__setattr__(self, "radii_m", generator.uniform(*_SIZES_M, self.count))
        one = _KINDS.index(self.kind) if self.kind in _KINDS else None
        kinds = np.arange(self.count) % len(_KINDS) if one is None else np.full(self.count, one)
        object.__setattr__(self, "kinds", kinds)

    def at(self, time_s: float) -> FloatArray:
        """Where the centres (n, 3) are: the first `moving` go to and fro."""
        centers_m: FloatArray = self.centers_m.copy()
        centers_m[: self.moving, 0] += _FASTEST_M_S * np.sin(time_s + np.arange(self.moving))
        return centers_m


class CrowdedCamera:
    """An ObjectSource that sees the crowd, too."""

    def __init__(self, camera: ObjectSource, crowd: Crowd, *, only: bool = False) -> None:
        """only: the crowd alone is seen."""
        self._camera, self._crowd, self._only = camera, crowd, only
        self._own: PerceivedObjects | None = None
        self._shown: PerceivedObjects | None = None
        self._roles: tuple[Role, ...] = ()
        self._names = tuple(f"crowd {k}" for k in range(crowd.count))

    def perceive(self, now_s: float) -> PerceivedObjects:
        """The camera's frame and the crowd as it was then; the same until there is a newer one."""
        own = self._camera.perceive(now_s)
        if self._shown is None or own is not self._own:
            self._own, self._shown = own, self._with_crowd(own)
        return self._shown

    def set_role(self, name: str, role: Role) -> None:
        """Of one of the camera's own."""
        self._camera.set_role(name, role)

    def _with_crowd(self, own: PerceivedObjects) -> PerceivedObjects:
        crowd = self._crowd
        if self._only:
            own = _without_objects(own)
        centers_m, first = crowd.at(own.time_s), len(own.names)
        spheres, boxes, tetrahedra = (np.flatnonzero(crowd.kinds == kind) for kind in range(len(_KINDS)))
        edge = 1.0 / np.sqrt(3.0)
        corners = edge * np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)])
        vertices = centers_m[tetrahedra, None] + crowd.radii_m[tetrahedra, None, None] * corners
        more: dict[str, Any] = {
            "sphere_centers_m": centers_m[spheres],
            "sphere_radii_m": crowd.radii_m[spheres],
            "sphere_object": first + spheres,
            "box_centers_m": centers_m[boxes],
            "box_rotations": np.broadcast_to(np.eye(3), (len(boxes), 3, 3)),
            "box_half_sizes_m": edge * np.broadcast_to(crowd.radii_m[boxes, None], (len(boxes), 3)),
            "box_object": first + boxes,
            "tetrahedron_vertices_m": vertices,
            "tetrahedron_object": first + tetrahedra,
        }
        joined: dict[str, Any] = {name: np.concatenate([getattr(own, name), values]) for name, values in more.items()}
        if self._roles[: len(own.roles)] != own.roles or self._shown is None:
            self._roles = own.roles + (Role.OBSTACLE,) * crowd.count
        unknown: dict[str, Any] = dict.fromkeys(("positions_m", "rotations", "velocities_m_s"))
        return replace(own, names=own.names + self._names, roles=self._roles, **(joined | unknown))


def _without_objects(own: PerceivedObjects) -> PerceivedObjects:
    none: dict[str, Any] = {
        name: value[:0]
        for name, value in vars(own).items()
        if isinstance(value, np.ndarray) and name not in ("positions_m", "rotations", "velocities_m_s")
    }
    return replace(own, names=(), roles=(), **none)
