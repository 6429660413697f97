"""Drivers of real arms against their real peers: `make test-arms`, and the table of `python -m tests.arms.table`."""
