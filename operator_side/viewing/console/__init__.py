"""Browser console: a separate process behind a gate that admits holders of this run's token."""
