"""Drivers of arms and cameras: each implements the port of an arm or of perceived objects; none knows the law."""
