"""Depth pictures from separate processes that have the cameras, written in any language."""

from collections.abc import Callable
from typing import Literal, NamedTuple

from robot_side.depth.picture import DepthPicture
from robot_side.drivers.remote.arm import Wire
from robot_side.drivers.remote.depth_message import DEPTH_VERSION, DepthMessage, SentMount, read_depth
from robot_side.drivers.remote.senders import Senders


class TakenDepth(NamedTuple):
    """Depth picture, and what its sender says of its camera."""

    picture: DepthPicture
    latest_s: float
    """Latest possible time at which it was taken, on our clock"""
    mount: SentMount | None
    """Where its camera is; None: as the settings say"""


class RemoteDepth:
    """Newest valid picture of each depth camera, from one sender for each camera."""

    def __init__(self, wire: Wire, note: Callable[[str], None]) -> None:
        """note: called with each fault's line."""
        self.senders: Senders[str] = Senders(wire, "depth pictures", DEPTH_VERSION, note)
        """Who sends each camera's pictures, and what was refused"""
        self._wire = wire
        self._fresh: dict[str, tuple[DepthMessage, tuple[float, float]]] = {}
        """Newest picture of each camera that has not been taken yet, and when it was made"""

    def update(self, now_s: float) -> tuple[str, ...]:
        """Take in what has arrived; return the cameras of which there is a picture to take."""
        for peer, payload, received_s in self._wire.receive():
            if (message := self.senders.read(read_depth, peer, payload, now_s)) is None:
                continue
            if (taken_s := self.senders.admit(message.camera, message, peer, received_s, now_s)) is not None:
                self._fresh[message.camera] = message, taken_s
        self.senders.note_silences(now_s)
        return tuple(self._fresh)

    def take(self, camera: str) -> TakenDepth | None:
        """Return the newest picture of a camera; None if it was taken before, or none has come."""
        if (newest := self._fresh.pop(camera, None)) is None:
            return None
        message, (earliest_s, latest_s) = newest
        return TakenDepth(message.picture(earliest_s), latest_s, message.mount)

    def refuse(self, why: Literal["mount", "late"], camera: str, text: str, now_s: float) -> None:
        """Refuse the camera's picture that was taken last: its mount is none of ours, or it is too old."""
        self.senders.refuse(why, camera, text, now_s)
