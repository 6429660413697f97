"""Overlap of one sphere with one ball, half-space, box or tetrahedron, in double precision."""
