"""Robot side, operator side and a router between them in containers: what docker/ starts, and what drives it."""
