"""Loop and process of both sides: each main is settings, parts, and `run`."""
