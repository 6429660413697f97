"""Encoding and decoding of a DualSense's input, output and feature reports."""
