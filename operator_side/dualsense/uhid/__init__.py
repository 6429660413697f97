"""Offering a simulated controller to every program on a Linux machine."""
