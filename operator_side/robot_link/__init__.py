"""Messages to the robot side: commands, lease, tuning wishes, and their sending."""
