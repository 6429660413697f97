"""Trials of a study: simulated participants, and what came out, from the recordings."""
