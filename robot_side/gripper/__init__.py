"""Shapes of the gripper and of a held object."""
