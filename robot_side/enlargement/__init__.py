"""Position error of the gripper, and the enlargement that covers it (eq. 3-10)."""

from robot_side.enlargement.distance import enlargement_distance

__all__ = ["enlargement_distance"]
