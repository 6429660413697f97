"""What it costs the robot side that somebody looks."""
