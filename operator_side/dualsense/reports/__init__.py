"""Bytes to values and back: the controller's input, output and feature reports."""
