"""Lease of the arm, observers, and the stops."""
