"""Recording of a run: the robot side's inputs as entries of a file."""
