"""The controller's driver beside pydualsense."""
