"""From the controller's state to an intent: travels, sticks, buttons."""
