"""Keyboard, mouse and gamepad of a browser's page: a second-class controller."""
