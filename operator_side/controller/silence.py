"""Silence of a controller: the time for which it has given no new state while we looked."""

from typing import Final

SILENT_S: Final = 0.15
"""Seconds without a new state after which a controller counts as gone"""
_COUNTED_S: Final = 0.05
"""Limit of the seconds that count from one look to the next; what is longer is a stall of this process or machine"""


class Silence:
    """Silence of one controller; it begins to count at the controller's first state."""

    def __init__(self) -> None:
        self._silent_s = 0.0
        self._looked_s: float | None = None

    def lasts(self, now_s: float, *, heard: bool) -> bool:
        """Take one look, with or without a new state; return whether the silence has lasted for SILENT_S."""
        if heard:
            self._silent_s, self._looked_s = 0.0, now_s
        elif self._looked_s is not None:
            self._silent_s += min(now_s - self._looked_s, _COUNTED_S)
            self._looked_s = now_s
        return self._silent_s > SILENT_S
