"""Depth cameras in the simulation: rendered pictures with the errors of real ones, and what is perceived by them."""
