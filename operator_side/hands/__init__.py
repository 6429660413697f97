"""From a controller's state to the operator's intent: calibrated travels, sticks and buttons."""
