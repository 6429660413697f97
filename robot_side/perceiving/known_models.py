"""Known models beside the surfaces that depth cameras see: they are felt as models, and taken out of the map."""

from collections.abc import Sequence
from typing import Final, Protocol, runtime_checkable

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.roles import Role
from robot_side.depth.picture import BOX, ELLIPSOID, SOLID_NUMBERS, SPHERE
from robot_side.perceiving.joined_frames import JoinedFrames
from robot_side.surroundings.fixed_objects import only
from robot_side.surroundings.kinds.layout import HALF_SPACE, TETRAHEDRON
from robot_side.surroundings.kinds.layout import SPHERE as SPHERE_KIND
from robot_side.surroundings.perceived import ObjectSource, PerceivedObjects
from robot_side.surroundings.placing import grouped, numbers_of, placed_rows, primitives_of
from robot_side.tick.events import Listener, Tick

_SOLIDS: Final = np.array([SPHERE, BOX, BOX, -1, BOX, ELLIPSOID])
"""Solid that stands for a primitive, by the number of its kind; no camera sees a half-space as a whole"""


def solids_of(frame: PerceivedObjects) -> FloatArray:
    """Return solids (k, 16) about the objects of a frame, as `OwnBody.of` takes them.

    Spheres, boxes and ellipsoids are exact. A mesh counts as the box around it, a tetrahedron as an upright one.
    """
    kinds = primitives_of(frame).kinds
    numbers = numbers_of(frame)
    solids = np.empty((len(kinds), SOLID_NUMBERS))
    solids[:, 0], solids[:, 1:] = _SOLIDS[kinds], placed_rows(numbers, grouped(kinds)).shapes
    spheres, corners = kinds == SPHERE_KIND, kinds == TETRAHEDRON
    solids[spheres, 13:] = solids[spheres, 4:5]
    placed_m = numbers[corners, :12].reshape(-1, 4, 3)
    low_m, high_m = placed_m.min(axis=1), placed_m.max(axis=1)
    solids[corners, 1:4], solids[corners, 13:] = 0.5 * (low_m + high_m), 0.5 * (high_m - low_m)
    solids[spheres | corners, 4:13] = np.eye(3).ravel()
    seen: FloatArray = solids[kinds != HALF_SPACE]
    return seen


@runtime_checkable
class Mapped(ObjectSource, Protocol):
    """Source of what depth cameras see."""

    def explain(self, solids: FloatArray) -> None:
        """Take solids (k, 16), see `solids_of`, out of the map from the next picture on."""
        ...

    def put_back(self) -> None:
        """Forget what was seen."""
        ...

    def on_tick(self, tick: Tick) -> None:
        """Take what the gripper holds."""
        ...


class WithModels(Listener):
    """Source of surfaces, and of objects whose models are known, behind these in each frame."""

    def __init__(self, surfaces: Mapped, models: ObjectSource, names: Sequence[str] | None = None) -> None:
        """names: which of the objects are known; None: all."""
        self._surfaces, self._models, self._names = surfaces, models, names
        self._joined = JoinedFrames()
        self._frames: tuple[PerceivedObjects, PerceivedObjects] | None = None
        """Newest frame of the models' source, and what of it is known"""

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`; ConfigurationError if an object of a known name does not exist."""
        frame = self._models.perceive(now_s)
        if self._frames is None or self._frames[0] is not frame:
            self._frames = frame, frame if self._names is None else only(frame, _indices(frame, self._names))
            self._surfaces.explain(solids_of(self._frames[1]))
        return self._joined.of(self._surfaces.perceive(now_s), self._frames[1])

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of an object from a later frame on."""
        known = self._joined.names.get(name)
        if known is None:
            self._surfaces.set_role(name, role)
        else:
            self._models.set_role(known, role)

    def on_tick(self, tick: Tick) -> None:
        """Let the surfaces' source hear."""
        self._surfaces.on_tick(tick)

    def put_back(self) -> None:
        """Forget the surfaces that were seen."""
        self._surfaces.put_back()


def _indices(frame: PerceivedObjects, names: Sequence[str]) -> list[int]:
    for name in names:
        if name not in frame.names:
            raise ConfigurationError(f"depth_camera.known = {name!r}; valid: {', '.join(frame.names)}")
    return [frame.names.index(name) for name in names]
