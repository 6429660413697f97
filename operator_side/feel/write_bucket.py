"""Token bucket for writes to a controller: at most 100 in any second, latest wins, releases at once.

A write costs one token. Setting a part that was off costs one more, in advance, for its release: so a release never
waits. Earlier writes delay a change by at most the refill of four tokens (a twentieth of a
second).
"""

import dataclasses
from typing import Final

from operator_side.controller.feel import RELEASED, Feel

MOST_WRITES_PER_S: Final = 100
_PARTS: Final = ("l2", "r2", "rumble")
_BURST: Final = 10.0
"""Capacity in tokens: after a rest a change is felt without delay."""
_REFILL_PER_S: Final = MOST_WRITES_PER_S - _BURST - len(_PARTS)
"""Refill rate: a second may begin with a full bucket, and with a paid release for each part."""


class WriteBucket:
    """Choice of the parts to write now; a part that goes off never waits."""

    def __init__(self) -> None:
        self._left = _BURST
        self._last_s: float | None = None

    def next(self, written: Feel | None, wanted: Feel, now_s: float) -> Feel | None:
        """Return the state after a write now; None for no write.

        written: state by the last write; None if unknown: then RELEASED is written regardless of tokens. wanted:
        desired state. Without enough tokens only the parts that go off are written; call again with the newest.
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
