"""How long a change of stiffness takes to the controller."""
