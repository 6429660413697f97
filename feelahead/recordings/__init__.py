"""Recordings computed again, shown, exported, drawn."""
