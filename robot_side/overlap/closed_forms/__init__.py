"""The closed forms: ball, half-space, and what every solid has in common."""
