"""Commands and tuning requests to the robot side and their sending; lease and stiffness from it."""
