"""Arithmetic beyond a double, and arctangents."""
