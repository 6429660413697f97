"""Surfaces around the gripper from depth cameras: what nobody modelled is perceived, too."""
