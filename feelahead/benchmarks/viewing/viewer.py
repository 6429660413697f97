"""Somebody who looks: says Hello and Watch to a real robot side, and takes what comes."""

from dataclasses import dataclass, field
from typing import Any

from common.clock import MonotonicClock, clock_domain
from common.protocol.codec import decode, decode_view, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Hello, StiffnessUpdate, Watch
from common.protocol.view_messages import SCENE_TOPIC, VIDEO_TOPIC, AnyViewMessage
from common.sockets.operator import OperatorSockets

_WATCH_PERIOD_S = 0.25


@dataclass
class Seen:
    """What came in one stretch of time; ages are those on arrival, by the clock that both processes share."""

    began_s: float
    ended_s: float = 0.0
    views: list[tuple[float, AnyViewMessage]] = field(default_factory=list)
    """(when it arrived, what)"""
    stiffness_ages_s: list[float] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    """Bytes of each of `views`"""


class Viewer:
    """One participant: the owner if it is the first, but it drives nothing."""

    def __init__(self, control: str, view: str, epoch: int) -> None:
        self._sockets = OperatorSockets(control, view, topics=(VIDEO_TOPIC, SCENE_TOPIC))
        self._end = LinkEnd("operator", epoch, clock_domain())
        self._clock = MonotonicClock()
        self._next_s = 0.0

    def look(self, seconds: float, **what: bool) -> Seen:
        """For so long, at `what` of overview, first_person and scene; the others are said to be looked at no more."""
        began_s = self._clock.now()
        seen = Seen(began_s)
        self._next_s = began_s
        while (now_s := self._clock.now()) < began_s + seconds:
            if now_s >= self._next_s:
                self._next_s = now_s + _WATCH_PERIOD_S
                self._sockets.send(encode(self._end.hello(now_s)))
                self._sockets.send(encode(Watch(self._end.stamp(now_s), **what)))
            self._sockets.wait(0.001)
            self._take(seen)
        seen.ended_s = self._clock.now()
        return seen

    def close(self) -> None:
        """Go away."""
        self._sockets.close()

    def _take(self, seen: Seen) -> None:
        now_s = self._clock.now()
        for payload in self._sockets.receive():
            message: Any = decode(payload)
            if isinstance(message, StiffnessUpdate):
                seen.stiffness_ages_s.append(now_s - message.header.sent_s)
            elif isinstance(message, Hello):
                self._end.arrived(message, now_s)
        for _, payload in self._sockets.receive_view():
            seen.views.append((now_s, decode_view(payload)))
            seen.lengths.append(len(payload))
