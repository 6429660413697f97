"""Viewer of a real robot side: sends Hello and Watch messages, and receives the views."""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from common.clock import MonotonicClock, clock_domain
from common.protocol.codec import VIEW_MAXIMUM_BYTES, decode, decode_view, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Hello, StiffnessUpdate, Watch
from common.protocol.view_messages import SCENE_TOPIC, VIDEO_TOPIC, AnyViewMessage
from common.rate.pieces import PIECE, Joining
from common.sockets.operator import OperatorSockets

_WATCH_PERIOD_S = 0.25
_COMPANION = b"robot_side.viewing.companion"


@dataclass
class Seen:
    """Messages received in some time. Ages are those on arrival, by the clock that all processes share."""

    began_s: float
    ended_s: float = 0.0
    views: list[tuple[float, AnyViewMessage]] = field(default_factory=list)
    """(time of arrival, message) of each view message"""
    stiffness_ages_s: list[float] = field(default_factory=list)


class Viewer:
    """Participant that receives views. The first one gets the lease, but commands nothing."""

    def __init__(self, control: str, view: str, epoch: int) -> None:
        self._sockets = OperatorSockets(control, view, topics=(VIDEO_TOPIC, SCENE_TOPIC))
        self._joining = {topic: Joining(VIEW_MAXIMUM_BYTES) for topic in (VIDEO_TOPIC, SCENE_TOPIC)}
        self._end = LinkEnd("operator", epoch, clock_domain())

    def say(self, now_s: float, what: Mapping[str, Any]) -> None:
        """Ask for the views in `what`: overview, first_person, scene. Views not asked for are no longer sent."""
        self._sockets.send(encode(self._end.hello(now_s)))
        self._sockets.send(encode(Watch(self._end.stamp(now_s), **what)))

    def take(self, seen: Seen, now_s: float) -> None:
        """Receive all messages that have arrived, into `seen`."""
        for payload in self._sockets.receive():
            message: Any = decode(payload)
            if isinstance(message, StiffnessUpdate):
                seen.stiffness_ages_s.append(now_s - message.header.sent_s)
            elif isinstance(message, Hello):
                self._end.arrived(message, now_s)
        for topic, payload in self._sockets.receive_view():
            of, is_piece, _ = topic.partition(PIECE)
            whole = self._joining[of].take(payload) if is_piece else payload
            if whole is not None:
                seen.views.append((now_s, decode_view(whole)))

    def wait(self, seconds: float) -> None:
        """Wait until a message comes, at most `seconds`."""
        self._sockets.wait(seconds)

    def close(self) -> None:
        """Close the sockets."""
        self._sockets.close()


def look(viewers: Sequence[Viewer], seconds: float, **what: Any) -> Seen:
    """Let all viewers receive views for `seconds`; return what the first one receives."""
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


def companion_of(process_id: int) -> int | None:
    """Return the id of the process that renders for the robot side `process_id`; None if there is none."""
    for children in Path(f"/proc/{process_id}/task").glob("*/children"):
        for child in children.read_text(encoding="ascii").split():
            with contextlib.suppress(OSError):
                if _COMPANION in Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0"):
                    return int(child)
    return None
