"""Checks of a brought model at the start, each with a line for people."""
