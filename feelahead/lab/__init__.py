"""Measurements and experiments (questions) on the whole system, and the engine that runs them.

Commands: `feelahead bench NAME` and `feelahead try NAME`.
"""
