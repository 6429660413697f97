"""Measurement of a controller's triggers and sticks, and storage of the result."""
