"""Measuring a controller's triggers, and keeping what was measured."""
