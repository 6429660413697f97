"""Owner of the perceived scene: tables of the newest frames, the target and the target's centre."""

from typing import Final

from common.arrays import FloatArray
from common.roles import Role
from robot_side.surroundings.perceived import ObjectSource, PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, go_to, make
from robot_side.surroundings.target import center_m, extent_middle_m, next_target, object_centers
from robot_side.surroundings.validity import require_valid

_KEPT: Final = 8
"""Number of frames whose tables are kept"""


class Surroundings:
    """Tables and targets of the recent frames."""

    def __init__(self) -> None:
        self._tables: dict[int, SceneTable] = {}
        """Tables by the identity of their frames"""
        self._target: tuple[object, int | None] = (None, None)
        """Roles that were searched last, and the target found"""

    def see(self, frame: PerceivedObjects) -> SceneTable:
        """Return the table of a frame, made on first use; ValueError if `require_valid` refuses the frame.

        Frames with the same first frame share one table, updated in place by each call. A refused frame changes
        nothing.
        """
        first = frame if frame.since is None else frame.since[0].first
        for kept in (first, frame):
            known = self._tables.get(id(kept))
            if known is not None and known.objects is frame:
                return known
        table = self._tables.get(id(first))
        if table is None:
            require_valid(first)
            table = self._keep(first, make(first))
        if table.objects is not frame and not go_to(table, frame):
            return self._keep(frame, make(frame))
        return table

    def target(self, frame: PerceivedObjects) -> int | None:
        """Return the index of the object whose role is the target, or None."""
        # Frames share their roles, which may be many.
        if self._target[0] is not frame.roles:
            self._target = frame.roles, frame.roles.index(Role.TARGET) if Role.TARGET in frame.roles else None
        return self._target[1]

    def center_m(self, frame: PerceivedObjects, index: int) -> FloatArray:
        """Return the centre (3,) of one object of a frame; see `target.center_m`.

        Where surfaces are perceived, an object is only a shell of some of its sides: its extent's middle counts.
        """
        table = self.see(frame)
        return center_m(table, index) if frame.surfaces is None else extent_middle_m(frame, index)

    def _keep(self, frame: PerceivedObjects, table: SceneTable) -> SceneTable:
        self._tables[id(frame)] = table
        if len(self._tables) > _KEPT:
            del self._tables[next(iter(self._tables))]
        return table


class Sight:
    """Newest frame, and the target's centre in it."""

    def __init__(self, camera: ObjectSource, surroundings: Surroundings) -> None:
        self.frame: PerceivedObjects | None = None
        self.target: int | None = None
        """Index of the target among the objects; None without a target"""
        self.target_m: FloatArray | None = None
        """(3,) centre of the target"""
        self._camera, self._surroundings = camera, surroundings

    def see(self, now_s: float) -> PerceivedObjects:
        """Read the camera's newest frame."""
        objects = self._camera.perceive(now_s)
        if objects is not self.frame:
            self._surroundings.see(objects)
            self.frame = objects
            self.target = self._surroundings.target(objects)
            self.target_m = None if self.target is None else self._surroundings.center_m(objects, self.target)
        return objects

    def choose_next(self, objects: PerceivedObjects, tool_position_m: FloatArray, approach: FloatArray) -> None:
        """Make the next object along the unit vector `approach` (3,) the target."""
        chosen = next_target(
            objects, self.target, object_centers(self._surroundings.see(objects)), tool_position_m, approach
        )
        if chosen is None:
            return
        if self.target is not None:
            self._camera.set_role(objects.names[self.target], Role.OBSTACLE)
        self._camera.set_role(chosen, Role.TARGET)
