"""Stress tests of single parts, and of the closed loop, for `feelahead bench stability`."""
