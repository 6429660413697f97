"""Simulated world behind the ports of arm and camera; only this package and the cameras use MuJoCo."""
