"""Boxes and tetrahedra, 64 pairs at a time in vector instructions."""
