"""Precise overlaps of single pairs of a sphere and a box or tetrahedron."""
