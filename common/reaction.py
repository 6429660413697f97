"""Reaction h: assumed time from a trigger's effect to the changed command; all code takes it from here."""

from typing import Final

REACTION_S: Final = 0.25
"""Time from a person's feeling the effect to releasing the trigger, in seconds (assumed; 0.25 to 0.3 s for touch)."""
FINGER_S: Final = 0.04
"""Duration of the finger's motion, in seconds (assumed)."""
WRITE_S: Final = 0.01
"""Period of writes to a controller, in seconds, as there are at most a hundred a second."""
HORIZON_S: Final = REACTION_S + FINGER_S + WRITE_S
"""h: time in seconds for which a commanded speed continues before an effect can change it; braking follows after it."""
