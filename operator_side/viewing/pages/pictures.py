"""Age from which a picture is old, silence from which its view is dead, and how far a page's hands count then.

A limit uses nothing of the pictures' own delay: a queue before them must show, and not raise the limit.
"""

import contextlib
import math
from collections import deque
from collections.abc import Iterable
from itertools import islice
from statistics import median
from typing import Final

from common.errors import RemoteProtocolError
from common.protocol.codec import decode_view
from common.protocol.view_messages import VIEW_NAMES, VideoFrame, VideoStep, ViewName
from operator_side.core import OperatorSide
from operator_side.viewing.facts import PictureFacts

_MARGIN_S: Final = 0.1
_LEAST_SILENCE_S: Final = 0.5
_INTERVALS_OLD, _INTERVALS_DEAD = 2.0, 3.0
_LONGEST_INTERVAL_S: Final = 1.0
"""Longest interval that counts, in seconds: a pause of the robot side is no rate of pictures."""
_FIRST_INTERVAL_S: Final = 1.0 / 30.0
_OTHER_CLOCK_S: Final = 1.0
"""A picture earlier than the newest by more is of another clock: the robot side has started anew."""
_KEPT: Final = 15
"""Number of pictures by which interval and size are measured"""
_TAIL: Final = 0.95
_WINDOW_S: Final = 10.0
"""Time over which the control stream's delay is measured, in seconds"""
_MOST_SAMPLES: Final = 1000
_PERIOD_S: Final = 0.25
_PATIENCE_S, _FALL_S, _RISE_S = 0.2, 0.6, 0.5
"""Old pictures are tolerated for the first, the hands fade in the second, and return in the third, in seconds."""
FIRST: Final[ViewName] = VIEW_NAMES[0]
"""View that is shown first: its age decides whether hands count."""


def old_after_s(
    *, control_p95_s: float, video_later_s: float, size_bytes: float, rate_bit_s: float | None, interval_s: float
) -> float:
    """Compute the age in seconds from which a picture is old.

    control_p95_s: 95 % of the control stream's one-way delays are below. video_later_s: delay that is configured for
    pictures on top of the control stream's. rate_bit_s: rate of the link; None if unknown.
    """
    carried_s = 8.0 * size_bytes / rate_bit_s if rate_bit_s else 0.0
    return control_p95_s + video_later_s + carried_s + _INTERVALS_OLD * interval_s + _MARGIN_S


def dead_after_s(interval_s: float) -> float:
    """Compute the silence in seconds from which a view is dead."""
    return max(_LEAST_SILENCE_S, _INTERVALS_DEAD * interval_s)


class _View:
    """Newest pictures of one view."""

    def __init__(self) -> None:
        self.captured_s = self.came_s = -math.inf
        self._intervals_s: deque[float] = deque(maxlen=_KEPT)
        self._sizes: deque[int] = deque(maxlen=_KEPT)

    @property
    def interval_s(self) -> float:
        known_s = median(self._intervals_s) if self._intervals_s else _FIRST_INTERVAL_S
        return min(known_s, _LONGEST_INTERVAL_S)

    @property
    def size_bytes(self) -> int:
        return max(self._sizes, default=0)

    def note(self, captured_s: float, size_bytes: int, now_s: float) -> None:
        if 0.0 <= self.captured_s - captured_s < _OTHER_CLOCK_S:
            return
        if captured_s > self.captured_s > -math.inf:
            self._intervals_s.append(captured_s - self.captured_s)
        self._sizes.append(size_bytes)
        self.captured_s, self.came_s = captured_s, now_s


class Pictures:
    """Freshness of the pictures that come, and the share of the hands that counts."""

    def __init__(self) -> None:
        self.video_later_s = 0.0
        """As for `old_after_s`; set by the caller, who knows the emulated link"""
        self.hands = 1.0
        """Share of a page's motion that counts, 0 to 1; 1 if no picture has ever come"""
        self._views = {name: _View() for name in VIEW_NAMES}
        self._old_s: dict[ViewName, float | None] = dict.fromkeys(VIEW_NAMES)
        self._control_p95_s: float | None = None
        self._fresh_s = self._measured_s = self._updated_s = -math.inf

    def receive(self, payload: bytes, now_s: float) -> None:
        """Take a payload of the topic `video`; an invalid one is ignored."""
        with contextlib.suppress(RemoteProtocolError):
            seen = decode_view(payload)
            if isinstance(seen, VideoFrame | VideoStep):
                size_bytes = len(seen.jpeg if isinstance(seen, VideoFrame) else seen.h264)
                self._views[seen.view].note(seen.captured_s, size_bytes, now_s)

    def update(self, core: OperatorSide, shown_s: float | None, now_s: float) -> None:
        """Measure, and let the hands fade or return.

        shown_s: capture time of the picture that the driving page shows, on the robot side's clock; None if unknown.
        """
        passed_s, self._updated_s = now_s - self._updated_s, now_s
        if not math.isfinite(self._views[FIRST].came_s):
            return
        if now_s - self._measured_s >= _PERIOD_S:
            self._measured_s = now_s
            self._measure(core, now_s)
        if not self._old(core.link.clock_offset.offset_s, shown_s, now_s):
            self._fresh_s = now_s
            self.hands = min(1.0, self.hands + passed_s / _RISE_S)
        elif now_s - self._fresh_s > _PATIENCE_S:
            self.hands = max(0.0, self.hands - passed_s / _FALL_S)

    def facts(self) -> PictureFacts:
        """Return the limits for the page."""
        views = self._views.values()
        return PictureFacts(tuple(self._old_s.values()), tuple(dead_after_s(view.interval_s) for view in views))

    def _measure(self, core: OperatorSide, now_s: float) -> None:
        newest = islice(reversed(core.link.recent), _MOST_SAMPLES)
        recent_s = (there_s for at_s, there_s, _ in newest if now_s - at_s <= _WINDOW_S)
        known_s = _tail(there_s for there_s in recent_s if there_s is not None)
        if known_s is not None:
            self._control_p95_s = known_s
        if self._control_p95_s is None:
            return
        kbit_s = core.status(now_s).rate_kbit_s
        for name, view in self._views.items():
            self._old_s[name] = old_after_s(
                control_p95_s=self._control_p95_s,
                video_later_s=self.video_later_s,
                size_bytes=view.size_bytes,
                rate_bit_s=None if kbit_s is None else 1e3 * kbit_s,
                interval_s=view.interval_s,
            )

    def _old(self, offset_s: float | None, shown_s: float | None, now_s: float) -> bool:
        view, limit_s = self._views[FIRST], self._old_s[FIRST]
        if offset_s is None or limit_s is None or now_s - view.came_s > dead_after_s(view.interval_s):
            return True
        captured_s = view.captured_s if shown_s is None else min(view.captured_s, shown_s)
        return now_s - (captured_s - offset_s) > limit_s


def _tail(samples_s: Iterable[float]) -> float | None:
    ordered = sorted(samples_s)
    return ordered[math.ceil(_TAIL * len(ordered)) - 1] if ordered else None
