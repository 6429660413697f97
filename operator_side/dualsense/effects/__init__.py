"""Trigger effects of a DualSense, and their encoding in bytes."""
