"""Joint velocities of a command, and the port of any arm."""
