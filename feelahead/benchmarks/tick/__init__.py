"""What a tick of the robot side costs, stage by stage, in the real process."""
