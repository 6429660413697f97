"""Companion processes, which a side starts and never waits for: cameras, a console, a recorder."""
