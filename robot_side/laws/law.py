"""Interface of every law: once a tick it computes two trigger fields and a rumble from a situation."""

from typing import Protocol

from common.protocol.around import Around
from robot_side.arm.port import GripperPose
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation


class Law(Protocol):
    """Computes the stiffness of both triggers from a situation."""

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the fields and the rumble of one tick."""
        ...

    def around(self, pose: GripperPose) -> Around | None:
        """Return the map of onset distances around the gripper, or None if there is no valid one.

        An operator side traces the gripper's path through the map.
        """
        ...

    def summary(self) -> dict[str, int]:
        """Return counts of the law's work over the run, for the run's summary."""
        ...
