"""Soak: all ports under attack at once, with keys, while an honest operator drives. `make soak` runs it."""
