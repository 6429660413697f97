"""Closed triangle meshes, convex or not."""
