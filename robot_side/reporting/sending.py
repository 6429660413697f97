"""Sending of the robot side's messages: through one budget, the emulated link, and the sockets."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, Protocol

from common.emulation.delay_line import BitFlip, DelayLine, link_summary
from common.emulation.spec import LinkSpec, Stream
from common.emulation.tuned import tuned_link
from common.protocol.view_messages import SCENE_TOPIC, VIDEO_TOPIC
from common.rate.budget import Budget
from common.rate.outgoing_queue import OutgoingQueue
from common.rate.pieces import PIECE
from robot_side.tick.outgoing import SENT_STREAMS, Outgoing, OutgoingStream

TOPICS: Final[dict[OutgoingStream, bytes]] = {"telemetry": b"telemetry", "video": VIDEO_TOPIC, "scene": SCENE_TOPIC}
"""Topics of the streams to viewers. The scene has its own stream, because its large messages would delay telemetry."""
_PACED: Final[tuple[OutgoingStream, ...]] = ("video", "scene")


class Sockets(Protocol):
    """Sockets for sending."""

    def send(self, peer: bytes, payload: bytes, *, everywhere: bool) -> bool:
        """Send a payload to one peer; everywhere: over each of its connections."""
        ...

    def publish(self, topic: bytes, payload: bytes) -> None:
        """Send a payload to all viewers, under `topic`."""
        ...


class _Leaving(NamedTuple):
    message: Outgoing
    topic: bytes


def _corrupted(leaving: _Leaving, flip: BitFlip) -> _Leaving:
    return leaving._replace(message=leaving.message._replace(payload=flip(leaving.message.payload)))


class Sending:
    """Sender: haptics leave at once, telemetry if the budget permits, pictures and scene in pieces between ticks."""

    def __init__(self, link: LinkSpec, sockets: Sockets, first_number: int) -> None:
        """first_number: number of the first message that leaves in pieces; different in each run."""
        self.budget: Budget[OutgoingStream] = Budget(_PACED, first_number)
        self._link, self._sockets = link, sockets
        self._lines: dict[Stream, DelayLine[_Leaving]] = {
            stream: DelayLine(link.profile("to_operator", stream), corrupt=_corrupted) for stream in SENT_STREAMS
        }

    def push(self, messages: Sequence[Outgoing], now_s: float) -> None:
        """Queue messages of the core or of the views."""
        for message in messages:
            size_bytes = len(message.payload)
            if message.stream in _PACED:
                self.budget.offer(message.stream, message.payload, now_s)
            elif message.stream == "haptics":
                self.budget.spend("haptics", size_bytes, now_s)
                self._enter(message, b"", now_s)
            elif self.budget.may_send_telemetry(size_bytes, now_s):
                self._enter(message, TOPICS[message.stream], now_s)

    def send(self, queue: OutgoingQueue | None, now_s: float) -> None:
        """Send the messages that are due.

        queue: queueing delays of messages to the owner; None while nobody owns the lease.
        """
        self.budget.hear(queue, now_s)
        for stream, payload, is_piece in self.budget.take(now_s):
            topic = TOPICS[stream] + (PIECE if is_piece else b"")
            self._enter(Outgoing(stream, b"", payload), topic, now_s)
        for line in self._lines.values():
            for message, topic in line.pop(now_s):
                if message.stream == "haptics":
                    self._sockets.send(message.peer, message.payload, everywhere=message.everywhere)
                else:
                    self._sockets.publish(topic, message.payload)

    def _enter(self, message: Outgoing, topic: bytes, now_s: float) -> None:
        for line in self._lines.values():
            line.begin(now_s)
        self._lines[message.stream].push(now_s, _Leaving(message, topic), len(message.payload))

    def tune(self, words: str) -> None:
        """Emulate the link described by `words` from now on."""
        self._link = tuned_link(self._link, words)
        for stream, line in self._lines.items():
            line.change(self._link.profile("to_operator", stream))

    def next_due(self) -> float | None:
        """Return the time at which the emulated link next delivers a message; None if the link is empty."""
        return min((due_s for line in self._lines.values() if (due_s := line.next_due()) is not None), default=None)

    @property
    def left_bit_s(self) -> float:
        """Rate that haptics and telemetry leave for pictures and the scene, in bit/s"""
        return self.budget.left_bit_s

    @property
    def begins(self) -> bool:
        """Whether no limit of the link's rate has been noticed yet"""
        return self.budget.controller.begins

    def backlog_s(self, stream: OutgoingStream, now_s: float) -> float:
        """Return how long a new message of `stream` would wait, in seconds, in the budget or in the emulated link."""
        return max(self.budget.waiting_s(stream), self._lines[stream].backlog_s(now_s))

    def summary(self) -> dict[str, Any]:
        """Return the summary's entry `link`: figures of the emulated link."""
        return link_summary("to_operator", {name: line for name, line in self._lines.items() if line.figures.sent})
