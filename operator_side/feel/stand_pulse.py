"""Say by one short pulse that a held object has come to stand."""

import math
from typing import Final

PULSE_S: Final = 0.08
_STRENGTH: Final = 0.7


class StandPulse:
    """Pulse of the right motor alone: the left one says danger, and both say that the field is lost."""

    def __init__(self) -> None:
        self._stands = False
        self._ends_s = -math.inf

    def right(self, stands: bool, now_s: float) -> float:
        """Drive of the right motor at `now_s`, 0 to 1; stands: as the newest field says."""
        if stands and not self._stands:
            self._ends_s = now_s + PULSE_S
        self._stands = stands
        return _STRENGTH if now_s < self._ends_s else 0.0
