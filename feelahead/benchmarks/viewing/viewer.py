"""Those who look: they say Hello and Watch to a real robot side, and take what comes."""

from collections.abc import Mapping, Sequence
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
    """One participant: the first is the owner, but it drives nothing."""

    def __init__(self, control: str, view: str, epoch: int) -> None:
        self._sockets = OperatorSockets(control, view, topics=(VIDEO_TOPIC, SCENE_TOPIC))
        self._end = LinkEnd("operator", epoch, clock_domain())

    def say(self, now_s: float, what: Mapping[str, bool]) -> None:
        """What is looked at, of overview, first_person and scene; the others no more."""
        self._sockets.send(encode(self._end.hello(now_s)))
        self._sockets.send(encode(Watch(self._end.stamp(now_s), **what)))

    def take(self, seen: Seen, now_s: float) -> None:
        """What has come."""
        for payload in self._sockets.receive():
            message: Any = decode(payload)
            if isinstance(message, StiffnessUpdate):
                seen.stiffness_ages_s.append(now_s - message.header.sent_s)
            elif isinstance(message, Hello):
                self._end.arrived(message, now_s)
        for _, payload in self._sockets.receive_view():
            seen.views.append((now_s, decode_view(payload)))
            seen.lengths.append(len(payload))

    def wait(self, seconds: float) -> None:
        """Until something comes."""
        self._sockets.wait(seconds)

    def close(self) -> None:
        """Go away."""
        self._sockets.close()


def look(viewers: Sequence[Viewer], seconds: float, **what: bool) -> Seen:
    """All of them, for so long; what the first one sees."""
    clock = MonotonicClock()
    next_s = began_s = clock.now()
    seen, others = Seen(began_s), Seen(began_s)
    while (now_s := clock.now()) < began_s + seconds:
        if now_s >= next_s:
            next_s = now_s + _WATCH_PERIOD_S
            for viewer in viewers:
                viewer.say(now_s, what)
        viewers[0].wait(0.001)
        for viewer in viewers:
            viewer.take(seen if viewer is viewers[0] else others, clock.now())
    seen.ended_s = clock.now()
    return seen
