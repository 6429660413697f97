"""Rates of the pictures and the scene that a page keeps up with, by its lateness and the pictures that it skips."""

import math
from typing import Final, NamedTuple


class Pace(NamedTuple):
    """Limits of what is sent to the pages; None for no limit."""

    picture_hz: float | None
    halved: bool
    """Whether pictures have half the width and height"""
    scene_hz: float | None


_PACES: Final = (
    Pace(None, halved=False, scene_hz=None),
    Pace(20.0, halved=False, scene_hz=None),
    Pace(15.0, halved=False, scene_hz=None),
    Pace(15.0, halved=True, scene_hz=None),
    Pace(10.0, halved=True, scene_hz=None),
    Pace(5.0, halved=True, scene_hz=None),
    Pace(5.0, halved=True, scene_hz=10.0),
    Pace(5.0, halved=True, scene_hz=5.0),
)
"""Paces from the fastest to the slowest: first the pictures give way, then the scene and the charts"""
_BEGINS: Final = 3
"""Index of the first pace: pictures that two slow processors draw, code and show beside both sides"""
_LAST_SKIPPED: Final = 4
"""Index of the slowest pace that is taken because of skipped pictures: they are lost work, and make nobody wait"""
_LATE_S, _EARLY_S = 0.2, 0.1
"""Lateness above which a slower pace is taken, and below which a faster one may be"""
_SKIPS, _TAKES = 0.3, 0.1
"""Share of the pictures that a page skips above which a slower pace is taken, and below which a faster one may be"""
_DOWN_S: Final = 1.0
_EAGER_S, _PATIENCE_S, _MOST_PATIENCE_S = 0.5, 4.0, 60.0
"""Time, in seconds, before a faster pace is taken: while the page was never late, and afterwards. It doubles each time
that a faster pace was in vain, up to the third."""


class PagePace:
    """Choice of the pace: slower soon, faster after a while in which the page was early."""

    def __init__(self) -> None:
        self._because = ""
        self._at = _BEGINS
        self._patience_s = _EAGER_S
        self._changed_s = self._early_since_s = -math.inf
        self._rose = False
        """Whether the newest change was to a faster pace"""

    @property
    def now(self) -> Pace:
        """Present pace"""
        return _PACES[self._at]

    @property
    def because(self) -> str:
        """Why pictures are fewer or smaller, with what was measured; empty if they are not, or a run has just begun."""
        return self._because if self._at > 0 else ""

    @property
    def seldom(self) -> bool:
        """Whether the scene, and the page's charts, are drawn less often, too."""
        return self.now.scene_hz is not None

    def update(self, late: tuple[float, float] | None, now_s: float) -> None:
        """Take in how late the pages' answers are, in seconds, and the share of the pictures that they skip.

        None if no page is visible.
        """
        late_s, skips = (0.0, 0.0) if late is None else late
        if late is None or late_s > _EARLY_S or skips > _TAKES:
            self._early_since_s = now_s
        skipping = skips > _SKIPS and self._at < _LAST_SKIPPED
        if (late_s > _LATE_S or skipping) and now_s - self._changed_s >= _DOWN_S:
            late_words = f"the page was late by {1e3 * late_s:.0f} ms"
            self._because = late_words if late_s > _LATE_S else f"the page skipped {100 * skips:.0f} % of them"
            in_vain = self._rose and now_s - self._changed_s < 2.0 * self._patience_s
            doubled_s = 2.0 * self._patience_s if in_vain else self._patience_s
            self._patience_s = min(_MOST_PATIENCE_S, max(_PATIENCE_S, doubled_s))
            self._at, self._changed_s, self._rose = min(self._at + 1, len(_PACES) - 1), now_s, False
        elif now_s - max(self._early_since_s, self._changed_s) >= self._patience_s and self._at > 0:
            self._patience_s = min(self._patience_s, _PATIENCE_S) if self._rose else self._patience_s
            self._at, self._changed_s, self._rose = self._at - 1, now_s, True
