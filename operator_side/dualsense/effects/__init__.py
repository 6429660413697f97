"""Trigger effects, and their bytes."""
