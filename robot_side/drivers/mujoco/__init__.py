"""Simulated world behind the ports of arm and camera; only this package and `viewing` use MuJoCo."""
