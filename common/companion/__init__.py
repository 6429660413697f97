"""Processes besides a side's, for which it never waits: cameras, a console, a recorder."""
