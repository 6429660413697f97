"""What the camera says is there: perceived objects, their roles, the target."""
