"""Codec of the controller's input, output and feature reports."""
