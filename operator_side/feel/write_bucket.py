"""Token bucket for writes to a controller: at most 100 in any second. A release never waits.

A write costs one token. A write that switches a part on costs one more, which pays for the part's release in advance.
A change waits at most until four tokens are refilled (a twentieth of a second); then the newest values are written.
"""

import dataclasses
from typing import Final

from operator_side.controller.feel import RELEASED, Feel

MOST_WRITES_PER_S: Final = 100
_PARTS: Final = ("l2", "r2", "rumble")
_BURST: Final = 10.0
"""Capacity of the bucket in tokens, so that after a pause a change is written without delay"""
_REFILL_PER_S: Final = MOST_WRITES_PER_S - _BURST - len(_PARTS)
"""Tokens refilled a second: fewer than 100, as a second may begin with a full bucket and paid releases."""


class WriteBucket:
    """Chooses the parts to write now; switching a part off never waits."""

    def __init__(self) -> None:
        self._left = _BURST
        self._last_s: float | None = None

    def next(self, written: Feel | None, wanted: Feel, now_s: float) -> Feel | None:
        """Return the state that a write at `now_s` should set; None if nothing should be written.

        written: state after the last write; if None (unknown), the result is RELEASED, regardless of tokens. wanted:
        desired state. Without enough tokens only parts to be switched off are written; call again for the others.
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
