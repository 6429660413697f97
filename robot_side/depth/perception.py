"""From pictures to surfaces that are handed on: the map, and a fixed pool of objects that shows it."""

from dataclasses import asdict, replace
from typing import Final

from common.arrays import FloatArray
from common.roles import Role
from robot_side.depth.depth_map import DepthMap, Integrated
from robot_side.depth.picture import CameraPose, DepthErrors, DepthPicture, OwnBody
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import EXACT, TARGET_NAME, SlotChanges, Slots
from robot_side.surroundings.perceived import UnknownSpace

_AROUND_M: Final = (0.06, 0.25)
"""Half width of the gripper's section, and reach, within which unseen space is told"""
_FELT_M: Final = 0.3
"""Reach within which unseen space may be felt"""


class DepthPerception:
    """Surfaces from the pictures of several cameras."""

    def __init__(self, settings: MapSettings) -> None:
        self._errors = EXACT
        self.last: Integrated | None = None
        """What the newest picture did; None before the first"""
        self._map, self._unseen_is_felt = DepthMap(settings), settings.unseen == "half"
        self._slots = Slots(settings.slots)

    def see(self, picture: DepthPicture, pose: CameraPose, body: OwnBody, errors: DepthErrors, camera: int) -> None:
        """Add a picture of `camera` to the map. pose, body: as they were when it was taken."""
        self._errors, self._body = errors, body
        self.last = self._map.integrate(picture, pose, body, errors, camera)

    def changes(self, near_m: FloatArray, *, holds: bool = False) -> SlotChanges:
        """Return what has changed since the last call, the surfaces nearest to `near_m` (3,) first.

        holds: whether the gripper holds something.
        """
        boxes = self._map.boxes()
        moves = self._map.velocities_m_s(boxes), self._map.moved_s
        return self._slots.update(boxes, near_m, self._errors, *moves, holds=holds)

    def whole(self) -> SlotChanges:
        """Return all surfaces as changes, for a process that has missed some."""
        return self._slots.whole()

    def set_role(self, name: str, role: Role) -> None:
        """Give the role to the patch of surface around the object `name`; all of the target has one role."""
        if name == TARGET_NAME and role is not Role.TARGET:
            self._map.unmark(Role.TARGET)
        elif (box := self._slots.box_of(name)) is not None:
            self._map.mark(box, role)

    def newest(self) -> dict[str, float]:
        """Return what the newest picture did; nothing before the first."""
        return {} if self.last is None else {name: float(value) for name, value in asdict(self.last).items()}

    def unknown(self, tool_m: FloatArray, rotation: FloatArray) -> UnknownSpace:
        """Return the space around the tool that nobody has seen.

        tool_m (3,), rotation (3, 3): pose of the tool, which advances along its z.
        """
        found = self._map.seen.unknown(tool_m, rotation, *_AROUND_M)
        if not self._unseen_is_felt or self.last is None:
            return found
        surfels = self._map.surfels
        points_m = surfels.table.points_m[surfels.shown]
        return replace(found, boxes_m=self._map.seen.boxes_m(tool_m, _FELT_M, points_m, self._body))
