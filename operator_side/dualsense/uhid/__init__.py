"""Simulated controller that every program on a Linux machine can use, offered through the kernel's uhid."""
