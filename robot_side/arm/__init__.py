"""From a command to joint velocities, and the port of any arm."""
