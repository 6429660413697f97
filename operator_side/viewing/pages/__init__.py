"""Keyboard, mouse and gamepad of a browser's page: second-class hands on a simulated controller."""
