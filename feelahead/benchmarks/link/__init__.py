"""The emulated link beside netem, and how late a loop wakes."""
