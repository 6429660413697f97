"""Arithmetic with more digits than a float64 has, and arctangents."""
