"""Tests that follow the guide docs/two-machines.md on two simulated machines, and then cause the faults of a LAN."""
