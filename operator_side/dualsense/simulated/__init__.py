"""Simulated DualSense, with a mechanical model of the triggers and of the fingers on them."""
