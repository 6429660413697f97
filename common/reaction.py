"""How long it takes from a trigger's effect to what the arm is told: one number for whoever reckons with it."""

from typing import Final

REACTION_S: Final = 0.25
"""What a person needs from feeling to letting go (assumed; 0.25 to 0.3 s for touch)."""
FINGER_S: Final = 0.04
"""And the finger's own way (assumed)."""
WRITE_S: Final = 0.01
"""A controller is written to at most a hundred times a second."""
HORIZON_S: Final = REACTION_S + FINGER_S + WRITE_S
"""h: for so long a speed goes on before anything felt can change it; braking comes on top."""
