"""Motion of surfaces: what moves from earlier pictures to the newest one, how fast, and the map that moves with it."""
