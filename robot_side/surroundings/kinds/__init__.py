"""Kinds of primitives that objects consist of, one a file: arrays, bounds, nearest point, contact, overlap."""
