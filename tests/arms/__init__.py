"""Drivers of real arms and of depth with their real peers: `make test-arms`, and `python -m tests.arms.table`."""
