"""Checks of the arguments of the public overlap functions."""
