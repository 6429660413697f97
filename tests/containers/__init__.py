"""Tests that build and run containers of both sides and the router: `python -m tests.containers`."""
