"""How often a controller is written to: at most 100 times in any second, the newest winning."""

from typing import Final

MOST_WRITES_PER_S: Final = 100
_BURST = 10.0
"""Writes that may follow each other at once, so that a change after a rest is felt without delay."""
_DEBT = 3.0
"""Releases that may exceed the bound: one for each part (two triggers, the rumble) that was set within it."""
_REFILL_PER_S = MOST_WRITES_PER_S - _BURST - _DEBT


class WriteBound:
    """Lets a write through or tells it to wait; a release never waits, but counts.

    A release takes off what was set by a write that did count, so that releases cannot get far ahead of it.
    """

    def __init__(self) -> None:
        self._left = _BURST
        self._last_s: float | None = None

    def allows(self, now_s: float, *, releasing: bool) -> bool:
        """Whether to write at `now_s`; if not, ask again with what is newest then."""
        if self._last_s is not None:
            self._left = min(self._left + max(now_s - self._last_s, 0.0) * _REFILL_PER_S, _BURST)
        self._last_s = now_s
        if not releasing and self._left < 1.0:
            return False
        self._left -= 1.0
        return True
