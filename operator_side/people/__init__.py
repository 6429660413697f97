"""A scripted person who pulls, feels and looks."""
