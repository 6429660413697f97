"""Keyboard, mouse and gamepad of a browser's page, used as a controller that cannot resist the finger."""
