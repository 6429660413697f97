"""Overlap of spheres with closed triangle meshes, convex or not."""
