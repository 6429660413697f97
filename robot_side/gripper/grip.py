"""State of the held object, from grip to release, and whether the object stands on something."""

from typing import Final

import numpy as np

from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.touchdown import Touchdown, carried_n
from robot_side.gripper.held_covers import HeldCovers
from robot_side.gripper.held_object import HeldObject, grip, gripped_object, with_held
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings

_LET_GO_S: Final = 0.1
"""Time, in seconds, without holding after which an object counts as released: fingers may move as they follow a slip"""


class Grip:
    """Held object of the gripper, if any."""

    def __init__(self, surroundings: Surroundings, covers: HeldCovers | None = None) -> None:
        """covers: spheres of the objects, made beforehand; None: made at each grip, which takes longer than a tick."""
        self.held: HeldObject | None = None
        self.touchdown = Touchdown()
        self._surroundings, self._covers = surroundings, covers
        self._held_s = -np.inf

    @property
    def index(self) -> int | None:
        """Index of the held object among the perceived objects; None if nothing is held."""
        return None if self.held is None else self.held.index

    def let_go(self) -> None:
        """Hold nothing."""
        self.held, self.touchdown = None, Touchdown()

    def update(self, objects: PerceivedObjects, pose: GripperPose, state: ArmState, rises_m_s: float) -> None:
        """Detect grip, release and touchdown of an object.

        rises_m_s: commanded speed of the tool upwards since the last call.
        """
        if state.gripper_holding:
            self._held_s = state.time_s
        if self.held is not None and (
            state.time_s - self._held_s > _LET_GO_S or objects.names[self.held.index] != self.held.name
        ):
            # Released, or forgotten by who perceives it: then its index is another object's.
            self.let_go()
        elif self.held is None and state.gripper_holding:
            index = gripped_object(self._surroundings.see(objects), pose.tool_position_m, state.gripper_opening_m)
            if index is not None:
                self.held = grip(objects, index, pose, self._covers)
        if self.held is not None:
            carried = carried_n(pose.tool_jacobian, state.joint_loads_nm)
            self.touchdown.update(carried, float(pose.tool_position_m[2]), rises_m_s, state.time_s)

    def joined(self, pose: GripperPose) -> GripperPose:
        """Return the pose of the gripper, with the held object's spheres if an object is held."""
        return pose if self.held is None else with_held(pose, self.held)
