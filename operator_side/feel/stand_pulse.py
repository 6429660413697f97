"""One short pulse says that what is held has come to stand."""

import math
from typing import Final

PULSE_S: Final = 0.08
_STRENGTH: Final = 0.7


class StandPulse:
    """Of the right motor alone: danger is the left one's, and without sight both say so."""

    def __init__(self) -> None:
        self._stands = False
        self._ends_s = -math.inf

    def right(self, stands: bool, now_s: float) -> float:
        """What the right motor does at `now_s`, 0 to 1, by the newest field."""
        if stands and not self._stands:
            self._ends_s = now_s + PULSE_S
        self._stands = stands
        return _STRENGTH if now_s < self._ends_s else 0.0
