"""Robots that a person brings: their reach, and the built-in table in front of them."""
