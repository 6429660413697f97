"""Tests that compare our emulation of links with the kernel's netem, run in User-Mode Linux: `make test-netem`."""
