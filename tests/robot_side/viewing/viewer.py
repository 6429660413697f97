"""Viewer of a real robot side: sends Hello and Watch messages, and receives the views."""

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar

from common.clock import MonotonicClock, clock_domain
from common.protocol.codec import VIEW_MAXIMUM_BYTES, decode, decode_view, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Hello, StiffnessUpdate, Watch
from common.protocol.view_messages import SCENE_TOPIC, VIDEO_TOPIC, AnyViewMessage
from common.rate.pieces import PIECE, Joining
from common.sockets.operator import OperatorSockets
from tests.helpers.machines.waiting import LIMIT_S

_WATCH_PERIOD_S: Final = 0.25
_COMPANION: Final = b"robot_side.viewing.companion"
_CLOCK: Final = MonotonicClock()
View = TypeVar("View")


@dataclass
class Seen:
    """Messages received in some time, whose stamps are by the clock that all processes share."""

    views: list[tuple[float, AnyViewMessage]] = field(default_factory=list)
    """(time of arrival, message) of each view message"""
    fields: int = 0
    """Number of stiffness messages"""

    def of(self, kind: type[View]) -> list[View]:
        """Return the view messages of this kind."""
        return [message for _, message in self.views if isinstance(message, kind)]


class Viewer:
    """Participant that receives views. The first one gets the lease, but commands nothing."""

    def __init__(self, control: str, view: str, epoch: int) -> None:
        self._sockets = OperatorSockets(control, view, topics=(VIDEO_TOPIC, SCENE_TOPIC))
        self._joining = {topic: Joining(VIEW_MAXIMUM_BYTES) for topic in (VIDEO_TOPIC, SCENE_TOPIC)}
        self._end = LinkEnd("operator", epoch, clock_domain())

    def look_until(self, enough: Callable[[Seen], object], **what: Any) -> Seen:
        """Ask for the views in `what` and receive until `enough` is true of all that came; return it.

        what: overview, first_person, scene, lacks. Views not asked for are no longer sent.
        """
        seen, said_s, end_s = Seen(), -math.inf, _CLOCK.now() + LIMIT_S
        while not enough(seen):
            now_s = _CLOCK.now()
            assert now_s < end_s, f"not within {LIMIT_S} s: {what}"
            if now_s >= said_s + _WATCH_PERIOD_S:
                said_s = now_s
                self._sockets.send(encode(self._end.hello(now_s)))
                self._sockets.send(encode(Watch(self._end.stamp(now_s), **what)))
            self._sockets.wait(0.01)
            self._take(seen)
        return seen

    def _take(self, seen: Seen) -> None:
        for payload in self._sockets.receive():
            message: Any = decode(payload)
            if isinstance(message, StiffnessUpdate):
                seen.fields += 1
            elif isinstance(message, Hello):
                self._end.arrived(message, _CLOCK.now())
        for topic, payload in self._sockets.receive_view():
            of, is_piece, _ = topic.partition(PIECE)
            whole = self._joining[of].take(payload) if is_piece else payload
            if whole is not None:
                seen.views.append((_CLOCK.now(), decode_view(whole)))

    def close(self) -> None:
        """Close the sockets."""
        self._sockets.close()


def companion_of(process_id: int) -> int | None:
    """Return the id of the process that renders for the robot side `process_id`; None if there is none."""
    for children in Path(f"/proc/{process_id}/task").glob("*/children"):
        for child in children.read_text(encoding="ascii").split():
            with contextlib.suppress(OSError):
                if _COMPANION in Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0"):
                    return int(child)
    return None
