"""One loop and one process for both sides: each main is settings, parts, and `run`."""
