"""Perceived objects, their roles, and the target."""
