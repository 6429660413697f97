"""Replay, display, export and plots of recordings."""
