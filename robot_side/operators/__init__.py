"""Lease of the arm, observers, and everything that stops the arm."""
