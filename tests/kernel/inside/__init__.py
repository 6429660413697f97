"""Tests that pytest runs inside the virtual machine: the kernel's driver and ours, each on a virtual controller."""
