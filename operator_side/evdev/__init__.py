"""Gamepads without adaptive triggers, through Linux evdev."""
