"""Closed forms: ball, half-space, and the results that all solids share."""
