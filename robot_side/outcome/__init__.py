"""Outcome of a run: its figures, and true distances and contacts."""
