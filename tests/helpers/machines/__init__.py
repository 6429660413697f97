"""Helpers of the suites that need a machine."""
