"""Console in a real browser, fed by a real run: `python -m tests.console`."""
