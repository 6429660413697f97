"""Arithmetic with more digits than a double, and arctangents."""
