"""Loop and process that both sides use: a side's main only reads settings, makes the parts and calls `run`."""
