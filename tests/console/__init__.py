"""Tests of the console's page in a real browser, with data of a real run: `python -m tests.console`."""
