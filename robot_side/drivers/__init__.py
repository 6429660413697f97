"""Drivers of arms and cameras: each implements the ports of arm and surroundings, independently of the law."""
