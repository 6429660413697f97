"""A process of ours beside a side's own, which it never waits for: cameras, a console, a recorder."""
