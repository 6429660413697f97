"""Pictures from a separate process that has the cameras, written in any language. Nothing is decoded here."""

import math
from collections.abc import Callable
from typing import Final, Literal, NamedTuple, Protocol

from common.protocol.view_messages import ViewName
from robot_side.drivers.remote.arm import Wire
from robot_side.drivers.remote.picture_message import PICTURE_VERSION, Intrinsics, read_picture
from robot_side.drivers.remote.senders import Senders

_WATCHED_PERIOD_S, _UNWATCHED_PERIOD_S = 1.0 / 60.0, 0.25
"""Periods in which the port is asked for pictures"""
_BYTES_PER_S: Final = 16e6
"""Rate at which pictures are taken at most: those beyond are overtaken by newer ones at the port"""
_ASK_AGAIN_S: Final = 0.25


class AskedWire(Wire, Protocol):
    """Port whose newest messages arrive after each request."""

    def ask(self) -> bool:
        """Ask for the newest messages; return whether the request was sent."""
        ...


class TakenPicture(NamedTuple):
    """Picture of a view, as it was sent."""

    peer: bytes
    width: int
    height: int
    format: Literal["jpeg", "rgb8"]
    content: bytes
    captured_s: float
    """Earliest possible time at which it was taken, on our clock"""
    intrinsics: Intrinsics | None


class RemotePictures:
    """Newest valid picture of each view that is sent, from one sender for each view."""

    def __init__(self, wire: AskedWire, note: Callable[[str], None]) -> None:
        """note: called with each fault's line."""
        self.senders: Senders[ViewName] = Senders(wire, "pictures", PICTURE_VERSION, note)
        """Who sends each view, and what was refused"""
        self._wire = wire
        self._newest: dict[ViewName, TakenPicture] = {}
        self._fresh: set[ViewName] = set()
        """Views whose newest picture has not been taken yet"""
        self._next_ask_s = -math.inf

    def update(self, now_s: float, *, watched: bool) -> None:
        """Take the pictures that have arrived, and ask for newer ones. watched: whether somebody looks at them."""
        arrived = self._wire.receive()
        for message in arrived:
            self._receive(*message, now_s)
        period_s = _WATCHED_PERIOD_S if watched else _UNWATCHED_PERIOD_S
        if arrived:
            size = sum(len(payload) for _, payload, _ in arrived)
            self._next_ask_s = now_s + max(period_s, size / _BYTES_PER_S)
        if now_s >= self._next_ask_s:
            # An answer may be lost with the process that owns the port.
            self._next_ask_s = now_s + _ASK_AGAIN_S
            self._wire.ask()
        self.senders.note_silences(now_s)

    def sends(self, view: ViewName) -> bool:
        """Return whether a picture of this view has ever come."""
        return view in self._newest

    def fresh(self, view: ViewName) -> bool:
        """Return whether a picture of this view has come since the last `take`."""
        return view in self._fresh

    def take(self, view: ViewName) -> TakenPicture | None:
        """Return the newest picture of a view; None if it was taken before, or none has come."""
        if view not in self._fresh:
            return None
        self._fresh.remove(view)
        return self._newest[view]

    def newest(self, view: ViewName) -> TakenPicture | None:
        """Return the newest picture of a view, taken or not; None if none has come."""
        return self._newest.get(view)

    def refuse(self, view: ViewName, text: str, now_s: float) -> None:
        """Refuse the picture of a view that was taken last: it cannot be decoded."""
        self.senders.refuse("undecodable", view, text, now_s)

    def _receive(self, peer: bytes, payload: bytes, received_s: float, now_s: float) -> None:
        if (message := self.senders.read(read_picture, peer, payload, now_s)) is None:
            return
        if (taken_s := self.senders.admit(message.view, message, peer, received_s, now_s)) is not None:
            self._fresh.add(message.view)
            self._newest[message.view] = TakenPicture(
                *(peer, message.width, message.height, message.format, message.content),
                captured_s=taken_s[0],
                intrinsics=message.intrinsics,
            )
