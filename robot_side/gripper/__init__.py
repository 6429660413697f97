"""The gripper's shape, and what it holds."""
