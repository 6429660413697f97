"""Outcome of a run: its figures, true distances and contacts."""
