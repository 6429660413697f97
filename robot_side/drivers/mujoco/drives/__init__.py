"""Drives of the arm's joints: the actuators of a model, and the inputs with which they follow references."""
