"""Messages on the wire, and the session that each operator has with the robot side."""
