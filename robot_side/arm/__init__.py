"""Computation of joint velocities from a command, and the port of any arm."""
