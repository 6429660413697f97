"""Reaction: time from a trigger's effect to the changed command, the same for all who use it."""

from typing import Final

REACTION_S: Final = 0.25
"""Time from feeling to release, of a person (assumed; 0.25 to 0.3 s for touch)."""
FINGER_S: Final = 0.04
"""Time of the finger's motion (assumed)."""
WRITE_S: Final = 0.01
"""Period of writes to a controller: at most a hundred a second."""
HORIZON_S: Final = REACTION_S + FINGER_S + WRITE_S
"""h: time for which a speed continues before anything felt can change it; braking comes on top."""
