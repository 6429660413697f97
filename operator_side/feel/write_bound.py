"""How often a controller is written to: at most 100 times in any second, the newest winning, releases at once.

Each write costs one of what the bound has left, and setting a part that was off costs one more, ahead, for the write
that will release it. So a release is always paid for, and never waits; nothing else can be owed, so that nothing that
was written before keeps a change back for longer than four writes take to be earned (a twentieth of a second).
"""

import dataclasses
from typing import Final

from operator_side.controller.feel import RELEASED, Feel

MOST_WRITES_PER_S: Final = 100
_PARTS: Final = ("l2", "r2", "rumble")
_BURST: Final = 10.0
"""What may be left after a rest, so that a change is then felt without delay."""
_REFILL_PER_S: Final = MOST_WRITES_PER_S - _BURST - len(_PARTS)
"""A second may begin with all of the burst left, and with a release paid for each part."""


class WriteBound:
    """What of the newest wish to write now; a part that goes off is never among what has to wait."""

    def __init__(self) -> None:
        self._left = _BURST
        self._last_s: float | None = None

    def next(self, written: Feel | None, wanted: Feel, now_s: float) -> Feel | None:
        """What the triggers and motors are to do after a write now; None for no write, now or at all.

        `written`: what they do by the last write, None where nobody knows: they are released then, whatever is left.
        `wanted`: what they should do. When there is not enough left for all of it, only the parts that go off are
        written; ask again with what is newest then.
        """
        if self._last_s is not None:
            self._left = min(self._left + max(now_s - self._last_s, 0.0) * _REFILL_PER_S, _BURST)
        self._last_s = now_s
        if written is None:
            self._left = max(self._left - 1.0, 0.0)
            return RELEASED
        if self._allows(written, wanted):
            return wanted
        released = {part: off for part in _PARTS if getattr(wanted, part) == (off := getattr(RELEASED, part))}
        shown = dataclasses.replace(written, **released)
        return shown if self._allows(written, shown) else None

    def _allows(self, written: Feel, shown: Feel) -> bool:
        cost = 1 + _parts_on(shown) - _parts_on(written)
        if shown == written or cost > self._left:
            return False
        self._left = min(self._left - cost, _BURST)
        return True


def _parts_on(shown: Feel) -> int:
    return sum(getattr(shown, part) != getattr(RELEASED, part) for part in _PARTS)
