"""Whether pictures are lost so often that steps, each of which needs the one before, would show next to nothing.

Where a fifth of the messages is lost, steps let a view stand still for a third of the time and more; pictures that need
no other hardly do (`tests/robot_side/viewing/test_losses.py`).
"""

import math
from collections import deque
from typing import Final

from common.protocol.view_messages import ViewName

_MANY: Final = 4
"""Number of losses within `_WITHIN_S` seconds, of both views together, that are many"""
_WITHIN_S: Final = 3.0
_HOLDS_S, _LONGEST_S = 30.0, 300.0
"""Time before steps are tried again, in seconds; it doubles up to the second each time that they are lost at once"""


class Losses:
    """Losses that viewers report; each counts once until a whole picture has been made."""

    def __init__(self) -> None:
        self._newest_s: deque[float] = deque(maxlen=_MANY)
        self._last_whole: dict[ViewName, int] = {}
        self._until_s = -math.inf
        self._holds_s = _HOLDS_S

    def note(self, view: ViewName, whole: int, now_s: float) -> None:
        """Take in that viewers lack a picture made after the whole one with the number `whole`."""
        if self._last_whole.get(view) == whole or now_s < self._until_s:
            return
        self._last_whole[view] = whole
        self._newest_s.append(now_s)
        if len(self._newest_s) == _MANY and now_s - self._newest_s[0] <= _WITHIN_S:
            again = now_s - self._until_s < self._holds_s
            self._holds_s = min(2.0 * self._holds_s, _LONGEST_S) if again else _HOLDS_S
            self._until_s = now_s + self._holds_s
            self._newest_s.clear()

    def many(self, now_s: float) -> bool:
        """Return whether there are many, or were a moment ago."""
        return now_s < self._until_s
