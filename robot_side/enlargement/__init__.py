"""Position error of the gripper, and the enlargement D_σ that covers this and other errors (eq. 3-10)."""

from robot_side.enlargement.distance import enlargement_distance

__all__ = ["enlargement_distance"]
