"""State of the pictures that a page shows, fresh, old or dead, and how far a page's hands count then.

A limit uses nothing of the pictures' own delay: a queue before them must show, and not raise the limit.
"""

import contextlib
import math
from collections import deque
from collections.abc import Iterable
from itertools import islice
from typing import Final

from common.errors import RemoteProtocolError
from common.protocol.codec import decode_view
from common.protocol.view_messages import VIEW_NAMES, VideoFrame, VideoStep, ViewName
from operator_side.core import OperatorSide
from operator_side.viewing.facts import PictureFacts, PictureState

_MARGIN_S: Final = 0.1
_LEAST_SILENCE_S: Final = 0.5
_INTERVALS_OLD, _INTERVALS_DEAD = 2.0, 3.0
_LONGEST_INTERVAL_S: Final = 1.0
"""Longest interval that counts, in seconds: a pause of the robot side is no rate of pictures."""
_MOST_INTERVAL_S: Final = 0.25
"""Longest interval that a limit allows for, in seconds: pictures that come more seldom are old, and called so"""
_FIRST_INTERVAL_S: Final = 1.0 / 30.0
_OTHER_CLOCK_S: Final = 1.0
"""A picture earlier than the newest by more is of another clock: the robot side has started anew."""
_TAIL: Final = 0.95
_USUAL: Final = 0.9
"""Share of the intervals between pictures that are no longer than the one that counts: losses make some long"""
_WINDOW_S: Final = 10.0
"""Time over which the control stream's delay and the pictures' interval are measured, in seconds"""
_MOST_SAMPLES: Final = 1000
_PERIOD_S: Final = 0.25
_RISES, _FALLS = 0.2, 0.05
"""Greatest rates at which a limit follows what is measured, in seconds a second"""
_LOOK_S: Final = 0.2
_LOOKS: Final = 3
"""Number of looks in a row, each of `_LOOK_S`, that change a state"""
_UNSEEN_M: Final = 0.02
"""Motion, in metres, that old pictures may hide before the hands fade"""
_FALL_S, _RISE_S = 0.6, 0.5
"""The hands fade in the first, and return in the second, in seconds."""
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
    """Newest pictures of one view, and its state.

    A look lasts `_LOOK_S`: it is beyond the limit if the age always was, and within if it never was. Three such looks
    in a row change the state; an age that hovers round the limit does not.
    """

    def __init__(self) -> None:
        self.captured_s = self.came_s = -math.inf
        self.limit_s: float | None = None
        """Age from which a picture is old, which follows what is measured slowly; None while unknown"""
        self.interval_s = _FIRST_INTERVAL_S
        self.state = PictureState.FRESH
        self._newest: deque[tuple[float, float, int]] = deque(maxlen=_MOST_SAMPLES)
        """Time of arrival, interval and bytes of the pictures of the last `_WINDOW_S`"""
        self._step = -1
        """Number of the newest step that could be shown"""
        self._look_s = -math.inf
        self._ages = [False, False]
        """Whether this look has seen an age within the limit, and one beyond"""
        self._alike = 0
        """Number of looks in a row that were beyond the limit; below 0, that were within"""
        self._alive = 0
        """Number of looks since the view was silent"""

    @property
    def size_bytes(self) -> int:
        return max((size for *_, size in self._newest), default=0)

    def can_show(self, step: VideoStep) -> bool:
        """Return whether this step can be shown: a whole picture, or the next one after one that could be."""
        if not (step.whole or step.number == self._step + 1):
            return False
        self._step = step.number
        return True

    def note(self, captured_s: float, size_bytes: int, now_s: float) -> None:
        if 0.0 <= self.captured_s - captured_s < _OTHER_CLOCK_S:
            return
        interval_s = captured_s - self.captured_s
        known_s = interval_s if 0.0 < interval_s < math.inf else _FIRST_INTERVAL_S
        self._newest.append((now_s, min(known_s, _LONGEST_INTERVAL_S), size_bytes))
        self.captured_s, self.came_s = captured_s, now_s

    def measure(self, now_s: float) -> None:
        while self._newest and now_s - self._newest[0][0] > _WINDOW_S:
            self._newest.popleft()
        self.interval_s = _tail((interval_s for _, interval_s, _ in self._newest), _USUAL) or self.interval_s

    def follow(self, limit_s: float, passed_s: float) -> None:
        if self.limit_s is None:
            self.limit_s = limit_s
        self.limit_s += min(max(limit_s - self.limit_s, -_FALLS * passed_s), _RISES * passed_s)

    def look(self, age_s: float | None, now_s: float) -> None:
        """Take in that the picture shown has this age; None if that is unknown, which counts as beyond any limit."""
        silent = now_s - self.came_s > dead_after_s(self.interval_s)
        self._ages[age_s is None or self.limit_s is None or age_s > self.limit_s] = True
        if silent:
            self.state, self._alike, self._alive, self._ages = PictureState.DEAD, 0, 0, [False, False]
        if now_s - self._look_s < _LOOK_S:
            return
        self._look_s = now_s
        match self._ages:
            case [False, True]:
                self._alike = max(self._alike, 0) + 1
            case [True, False]:
                self._alike = min(self._alike, 0) - 1
            case _:
                self._alike = 0
        self._ages = [False, False]
        self._alive += 1
        if self._alike <= -_LOOKS:
            self.state = PictureState.FRESH
        elif self._alike >= _LOOKS or (self.state is PictureState.DEAD and self._alive >= _LOOKS):
            self.state = PictureState.OLD


class Pictures:
    """Freshness of the pictures that come, and the share of the hands that counts."""

    def __init__(self) -> None:
        self.video_later_s = 0.0
        """As for `old_after_s`; set by the caller, who knows the emulated link"""
        self.hands = 1.0
        """Share of a page's motion that counts, 0 to 1; 1 if no picture has ever come"""
        self.because = ""
        """Why less than all of the hands counts, with the measured age; empty if all counts"""
        self._views = {name: _View() for name in VIEW_NAMES}
        self._control_p95_s: float | None = None
        self._fades = False
        self._hid = ""
        """Words for the motion that was hidden when the hands began to fade"""
        self._measured_s = self._updated_s = -math.inf

    def receive(self, payload: bytes, now_s: float) -> None:
        """Take a payload of the topic `video`; an invalid one is ignored."""
        with contextlib.suppress(RemoteProtocolError):
            seen = decode_view(payload)
            if isinstance(seen, VideoFrame):
                self._views[seen.view].note(seen.captured_s, len(seen.jpeg), now_s)
            elif isinstance(seen, VideoStep) and self._views[seen.view].can_show(seen):
                self._views[seen.view].note(seen.captured_s, len(seen.h264), now_s)

    def update(self, core: OperatorSide, shown_s: float | None, now_s: float) -> None:
        """Measure, and let the hands fade or return.

        shown_s: capture time of the picture that the driving page shows, on the robot side's clock; None if unknown.
        """
        passed_s, self._updated_s = now_s - self._updated_s, now_s
        first = self._views[FIRST]
        if not math.isfinite(first.came_s):
            return
        if now_s - self._measured_s >= _PERIOD_S:
            measured_s, self._measured_s = min(now_s - self._measured_s, 2.0 * _PERIOD_S), now_s
            self._measure(core, measured_s, now_s)
        age_s, offset_s = None, core.link.clock_offset.offset_s
        for view in reversed(self._views.values()):
            captured_s = view.captured_s if shown_s is None or view is not first else min(view.captured_s, shown_s)
            age_s = None if offset_s is None else now_s - (captured_s - offset_s)
            if math.isfinite(view.came_s):
                view.look(age_s, now_s)
        if first.state is PictureState.FRESH:
            self._fades = False
        elif first.state is PictureState.DEAD:
            # Also at rest: what would begin to move now would not be seen at all.
            self._fades, self.because = True, f"no new picture has come for {now_s - first.came_s:.1f} s"
        else:
            if not self._fades:
                speed_m_s = None if core.screen is None else core.screen.tool_speed_m_s
                self._fades, self._hid = _hide_motion(age_s, speed_m_s)
            if self._fades:
                self.because = _age_words(age_s) + self._hid
        change = -passed_s / _FALL_S if self._fades else passed_s / _RISE_S
        self.hands = min(1.0, max(0.0, self.hands + change))
        if self.hands == 1.0:
            self.because = ""

    def facts(self) -> PictureFacts:
        """Return states and limits for the page."""
        views = self._views.values()
        limits = tuple(view.limit_s for view in views), tuple(dead_after_s(view.interval_s) for view in views)
        return PictureFacts(*limits, tuple(view.state for view in views))

    def _measure(self, core: OperatorSide, passed_s: float, now_s: float) -> None:
        newest = islice(reversed(core.link.recent), _MOST_SAMPLES)
        recent_s = (there_s for at_s, there_s, _ in newest if now_s - at_s <= _WINDOW_S)
        known_s = _tail((there_s for there_s in recent_s if there_s is not None), _TAIL)
        if known_s is not None:
            self._control_p95_s = known_s
        kbit_s = core.status(now_s).rate_kbit_s
        for view in self._views.values():
            view.measure(now_s)
            if self._control_p95_s is not None:
                limit_s = old_after_s(
                    control_p95_s=self._control_p95_s,
                    video_later_s=self.video_later_s,
                    size_bytes=view.size_bytes,
                    rate_bit_s=None if kbit_s is None else 1e3 * kbit_s,
                    interval_s=min(view.interval_s, _MOST_INTERVAL_S),
                )
                view.follow(limit_s, passed_s)


def _hide_motion(age_s: float | None, speed_m_s: float | None) -> tuple[bool, str]:
    """Return whether pictures of this age hide too much motion, and the words for it. What is unknown counts as too
    much."""
    if age_s is None or speed_m_s is None:
        return True, ""
    hidden_m = age_s * speed_m_s
    return hidden_m > _UNSEEN_M, f", which hid {1e3 * hidden_m:.0f} mm of motion"


def _age_words(age_s: float | None) -> str:
    return "the pictures' age is unknown" if age_s is None else f"pictures are {1e3 * age_s:.0f} ms old"


def _tail(samples_s: Iterable[float], share: float) -> float | None:
    ordered = sorted(samples_s)
    return ordered[math.ceil(share * len(ordered)) - 1] if ordered else None
