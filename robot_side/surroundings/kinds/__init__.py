"""Kinds of primitives that objects consist of, a file for each: arrays, bounds, nearest point, contact and overlap."""
