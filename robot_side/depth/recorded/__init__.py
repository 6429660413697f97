"""Recorded depth and clouds of points, as pictures of a depth camera."""
