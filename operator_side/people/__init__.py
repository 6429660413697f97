"""Scripted person who operates a simulated controller: pulls triggers, feels them, and sees the screen."""
