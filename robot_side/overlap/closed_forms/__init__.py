"""Closed forms of the overlap of a sphere with a ball or a half-space, and results that all solids share."""
