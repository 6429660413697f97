"""Tests that pytest runs inside the machine: the kernel's driver and ours on a virtual controller."""
