"""What the robot side drives: each driver implements the ports of arm and surroundings, and knows no law."""
