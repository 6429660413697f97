"""The kinds of primitives that objects are made of, one to a file: arrays, bounds, nearest point, contact, overlap."""
