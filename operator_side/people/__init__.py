"""Scripted person who pulls, feels and looks."""
