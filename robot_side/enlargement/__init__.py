"""How wrong the gripper's position may be, and how far it is enlarged therefore (eq. 3-10)."""

from robot_side.enlargement.distance import enlargement_distance

__all__ = ["enlargement_distance"]
