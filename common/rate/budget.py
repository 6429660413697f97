"""Budget of all messages that a side sends: urgent ones always leave, others share the remaining rate, in pieces."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, Final, Generic, Literal, NamedTuple, TypeVar

from common.rate.controller import RateController, Urgency
from common.rate.outgoing_queue import OutgoingQueue
from common.rate.pieces import LEAST_BYTES, piece_of
from common.silence import KEEP_ALIVE_S

_HEADERS_BYTES: Final = 90
"""Header bytes of one packet and its acknowledgement together: Ethernet, IP, TCP, ZeroMQ."""
_PACKET_BYTES: Final = 1400
SLICE_S: Final = 0.006
"""Transmission time of the largest piece, in seconds, and so the longest delay that a piece causes to a stiffness."""
_LEAST_PIECE_BYTES: Final = 2 * LEAST_BYTES
_DEBT_S: Final = 0.05
"""Longest time for which a burst of urgent messages holds back all other messages, in seconds."""
_WAITING: Final = 2
"""Maximum number of a stream's messages that wait and of which no piece has left; beyond it the oldest is dropped."""
_SHARE: Final = 0.6
"""Largest share of the allowed rate that haptics take; to stay below it they are sent less often."""
_TYPICAL_BYTES: Final = 200.0
_SMOOTHING_S: Final = 0.5
_URGENCY: Final = {"haptics": Urgency.MUST, "telemetry": Urgency.SOON}
_SELDOM_S: Final = 0.2
"""Longest time between two telemetry messages, in seconds, even if the budget is used up: a frozen screen would look
like a fault."""


def on_the_wire(size_bytes: int) -> int:
    """Return how many bytes a payload of `size_bytes` takes on the link, with headers and acknowledgements."""
    return size_bytes + _HEADERS_BYTES * max(1, math.ceil(size_bytes / _PACKET_BYTES))


Name = TypeVar("Name", bound=str)


class Leaving(NamedTuple, Generic[Name]):
    """Payload to send now: a whole message of `stream`, or a piece of one."""

    stream: Name
    payload: bytes
    is_piece: bool


class _Stream:
    """Messages of one stream that have not left completely; pieces of the first (`begun`) may have left."""

    def __init__(self) -> None:
        self.begun: bytes | None = None
        self.offset = 0
        self.waiting: deque[bytes] = deque()
        self.held_back = {"rate": 0, "queue": 0}

    @property
    def left_bytes(self) -> int:
        """Number of bytes of the stream that have not left yet."""
        begun = 0 if self.begun is None else len(self.begun) - self.offset
        return begun + sum(map(len, self.waiting))


class Budget(Generic[Name]):
    """Token bucket with strict priority: haptics, telemetry, `paced` streams. A RateController sets the bucket's rate.

    Haptics always leave, even if the bucket's level falls below 0. Messages of paced streams leave while the level
    allows it. A message of which a piece has left is sent to its end; before that it may be dropped for newer ones.
    """

    def __init__(self, paced: Sequence[Name] = (), first_number: int = 0) -> None:
        """paced: streams sent in pieces, most urgent first. first_number: one less than the first message's number."""
        self.controller = RateController()
        self._streams: dict[Name, _Stream] = {name: _Stream() for name in paced}
        self._number: dict[Name, int] = dict.fromkeys(paced, first_number)
        self._dropped = {"telemetry": {"rate": 0, "queue": 0}}
        self.level_bytes = 0.0
        """Level of the bucket: bytes that may leave at once; below 0 after urgent messages exceeded the rate."""
        self._now_s: float | None = None
        self._telemetry_s = -math.inf
        self._flows_s = math.inf
        """Last time at which no message was waiting because of the rate"""
        self._haptic_bytes = _TYPICAL_BYTES
        self._must_bit_s = 0.0
        """Smoothed rate at which haptics and telemetry are sent, in bit/s."""
        self._heard_from: OutgoingQueue | None = None
        self._measured: OutgoingQueue | None = None
        """OutgoingQueue of the newest peer, kept for the summary when no peer is present."""

    def hear(self, queue: OutgoingQueue | None, now_s: float) -> None:
        """Process the new echoes in the present peer's `queue`; None: there is no peer."""
        if queue is not self._heard_from:
            self._heard_from, self._measured = queue, queue or self._measured
            self.controller = RateController()
        for echo in [] if queue is None else queue.take():
            self.controller.heard(echo, now_s)

    def spend(self, stream: Name | Literal["haptics", "telemetry"], size_bytes: int, now_s: float) -> None:
        """Count a payload that leaves now, even if it exceeds the budget."""
        self._fill(now_s)
        taken = on_the_wire(size_bytes)
        self.controller.sent(taken, now_s, _URGENCY.get(stream, Urgency.PACED))
        self.level_bytes = max(self.level_bytes - taken, -_DEBT_S * self.controller.rate_bit_s / 8.0)
        if stream not in self._streams:
            self._must_bit_s += 8.0 * taken / _SMOOTHING_S
        if stream == "haptics":
            self._haptic_bytes += (taken - self._haptic_bytes) / 64.0

    def may_send_telemetry(self, size_bytes: int, now_s: float) -> bool:
        """Return whether telemetry of that size may leave now, and count it if so. If not, it is to be dropped."""
        self._fill(now_s)
        flows = self.controller.may_send(now_s)
        if (flows and self.level_bytes > 0.0) or now_s - self._telemetry_s >= _SELDOM_S:
            self._telemetry_s = now_s
            self.spend("telemetry", size_bytes, now_s)
            return True
        self._dropped["telemetry"]["rate" if flows else "queue"] += 1
        return False

    def offer(self, stream: Name, payload: bytes, now_s: float) -> None:
        """Queue a message of a paced stream."""
        one = self._streams[stream]
        one.waiting.append(payload)
        if len(one.waiting) > _WAITING:
            one.waiting.popleft()
            one.held_back["rate" if self.controller.may_send(now_s) else "queue"] += 1

    def take(self, now_s: float) -> list[Leaving[Name]]:
        """Return the payloads of paced streams to send at `now_s`. Call it in every turn."""
        self._fill(now_s)
        leaving: list[Leaving[Name]] = []
        for name, stream in self._streams.items():
            while (size_bytes := self._next_bytes(stream)) and self.controller.may_send(now_s):
                # A piece may exceed the bucket's depth by a quarter; then a full bucket suffices.
                if self.level_bytes < min(on_the_wire(size_bytes), self._depth_bytes):
                    break
                leaving.append(self._next(name, stream, size_bytes))
                self.spend(name, len(leaving[-1].payload), now_s)
        # Cut the level only now: with haptics in every turn the bucket would never be full.
        self.level_bytes = min(self.level_bytes, self._depth_bytes)
        if not self.controller.may_send(now_s) or not any(stream.left_bytes for stream in self._streams.values()):
            self._flows_s = now_s
        self.controller.update(now_s, limited=now_s - self._flows_s > SLICE_S)
        return leaving

    def _next_bytes(self, stream: _Stream) -> int:
        """Return the size of the next piece, 0 for none; a short last piece is joined to the one before it."""
        if stream.begun is None:
            if not stream.waiting:
                return 0
            left_bytes = len(stream.waiting[0])
        else:
            left_bytes = len(stream.begun) - stream.offset
        size_bytes = max(int(self._depth_bytes), _LEAST_PIECE_BYTES)
        return left_bytes if left_bytes <= 1.25 * size_bytes else size_bytes

    def _next(self, name: Name, stream: _Stream, size_bytes: int) -> Leaving[Name]:
        if stream.begun is None:
            stream.begun, stream.offset = stream.waiting.popleft(), 0
            self._number[name] += 1
        whole, offset = stream.begun, stream.offset
        stream.offset += size_bytes
        if stream.offset == len(whole):
            stream.begun = None
        if size_bytes == len(whole):
            return Leaving(name, whole, is_piece=False)
        return Leaving(name, piece_of(whole, self._number[name], offset, size_bytes), is_piece=True)

    @property
    def _depth_bytes(self) -> float:
        return SLICE_S * self.controller.rate_bit_s / 8.0

    def _fill(self, now_s: float) -> None:
        elapsed_s = 0.0 if self._now_s is None else max(0.0, now_s - self._now_s)
        self._now_s = now_s if self._now_s is None else max(now_s, self._now_s)
        bytes_s = self.controller.rate_bit_s / 8.0
        self.level_bytes += bytes_s * elapsed_s
        self._must_bit_s *= math.exp(-elapsed_s / _SMOOTHING_S)

    def waiting_s(self, stream: Name) -> float:
        """Return the time until a message offered now begins to leave; infinite if one of `stream` still has not begun.

        A sender that offers only at a finite time has no message dropped. Pictures that hold only the changes since
        the previous picture need that.
        """
        if self._streams[stream].waiting:
            return math.inf
        waiting_bytes = 0
        for name, one in self._streams.items():
            waiting_bytes += one.left_bytes
            if name == stream:
                break
        return 8.0 * waiting_bytes / self.left_bit_s if waiting_bytes else 0.0

    @property
    def left_bit_s(self) -> float:
        """Rate left for the paced streams by haptics and telemetry: at least a twentieth of the allowed rate."""
        rate_bit_s = self.controller.rate_bit_s
        return max(rate_bit_s - self._must_bit_s, 0.05 * rate_bit_s)

    @property
    def haptic_interval_s(self) -> float:
        """Least time between haptic messages to a peer: 0 until the link shows a limit, 20 ms while a queue drains."""
        if self.controller.drains:
            return KEEP_ALIVE_S
        if self.controller.begins:
            return 0.0
        return min(8.0 * self._haptic_bytes / (_SHARE * self.controller.rate_bit_s), KEEP_ALIVE_S)

    def held_back(self) -> dict[str, dict[str, int]]:
        """Return each stream's number of dropped messages, by the cause: `rate` used up, or `queue` in the link."""
        paced: dict[str, dict[str, int]] = {name: dict(stream.held_back) for name, stream in self._streams.items()}
        return self._dropped | paced

    def status(self) -> dict[str, float]:
        """Return the present queueing delay `queue_ms` and the allowed rate `rate_kbit_s`."""
        return {"queue_ms": 1e3 * self.controller.queue_s, "rate_kbit_s": 1e-3 * self.controller.rate_bit_s}

    def summary(self) -> dict[str, Any]:
        """Return the figures `allowed_kbit_s`, `queue_ms` (p50 and p95) and `held_back` for a run's summary."""
        queue = {"p50": None, "p95": None} if self._measured is None else self._measured.summary_ms()
        return {
            "allowed_kbit_s": 1e-3 * self.controller.rate_bit_s,
            "queue_ms": queue,
            "held_back": self.held_back(),
        }
