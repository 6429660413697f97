"""Simulated controller offered to every program on a Linux machine."""
