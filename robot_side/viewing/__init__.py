"""What people see of the scene: pictures, rendered beside the robot side, and the shapes of what is there."""
