"""Follow the camera's newest frame, and the target in it."""

from common.arrays import FloatArray
from common.roles import Role
from robot_side.surroundings.perceived import ObjectSource, PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from robot_side.surroundings.target import next_target, object_centers


class Sight:
    """The newest frame, and where the target is."""

    def __init__(self, camera: ObjectSource, surroundings: Surroundings) -> None:
        self.frame: PerceivedObjects | None = None
        self.target: int | None = None
        """The target's index among the objects; None without one"""
        self.target_m: FloatArray | None = None
        """(3,) its centre"""
        self._camera, self._surroundings = camera, surroundings

    def see(self, now_s: float) -> PerceivedObjects:
        """Take in the camera's newest frame."""
        objects = self._camera.perceive(now_s)
        if objects is not self.frame:
            self._surroundings.see(objects)
            self.frame = objects
            self.target = self._surroundings.target(objects)
            self.target_m = None if self.target is None else self._surroundings.center_m(objects, self.target)
        return objects

    def choose_next(self, objects: PerceivedObjects, tool_position_m: FloatArray, approach: FloatArray) -> None:
        """Make another object the target: the next one along the unit vector `approach` (3,)."""
        chosen = next_target(objects, self.target, object_centers(objects), tool_position_m, approach)
        if chosen is None:
            return
        if self.target is not None:
            self._camera.set_role(objects.names[self.target], Role.OBSTACLE)
        self._camera.set_role(chosen, Role.TARGET)
