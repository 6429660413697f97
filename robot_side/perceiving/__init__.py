"""Sources of objects by the settings: in this process, or beside it, so that no picture passes the one that ticks."""
