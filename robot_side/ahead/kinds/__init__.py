"""The kinds of primitives that objects are made of, a file each: layout, bounds, volume, nearest point."""
