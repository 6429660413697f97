"""Both sides and the router in containers, built and run for real: `python -m tests.containers`."""
