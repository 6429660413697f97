"""Recording of a run: the core's inputs as entries of a file."""
