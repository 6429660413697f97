"""Towards the robot side: commands, lease, wishes, and the way out."""
