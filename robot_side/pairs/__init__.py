"""Which sphere meets which object, where it is nearest, and how much overlaps."""
