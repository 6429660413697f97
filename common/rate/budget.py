"""One budget for all that a side sends: what must go is counted, what can wait gets what is left, in pieces."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, Final, Generic, Literal, NamedTuple, TypeVar

from common.rate.controller import RateController, Urgency
from common.rate.outgoing_queue import OutgoingQueue
from common.rate.pieces import LEAST_BYTES, piece_of
from common.silence import KEEP_ALIVE_S

_HEADERS_BYTES: Final = 90
"""Headers of a packet and its acknowledgement: Ethernet, IP, TCP, ZeroMQ."""
_PACKET_BYTES: Final = 1400
SLICE_S: Final = 0.006
"""A piece is at most what the rate carries in this time, so that it stands no longer in front of a stiffness."""
_LEAST_PIECE_BYTES: Final = 2 * LEAST_BYTES
_DEBT_S: Final = 0.05
"""A burst of what must go keeps all else back for no longer than this."""
_WAITING: Final = 2
"""Wholes of a stream that wait and have not begun; the oldest gives way to a newer one."""
_SHARE: Final = 0.6
"""Haptics slow down where they would take more of the rate than this."""
_TYPICAL_BYTES: Final = 200.0
_SMOOTHING_S: Final = 0.5
_URGENCY: Final = {"haptics": Urgency.MUST, "telemetry": Urgency.SOON}
_SELDOM_S: Final = 0.2
"""Telemetry leaves that often even where there is no room for it: a screen that stands still looks like a fault."""


def on_the_wire(size_bytes: int) -> int:
    """Bytes that a payload takes of the link, headers and acknowledgements included."""
    return size_bytes + _HEADERS_BYTES * max(1, math.ceil(size_bytes / _PACKET_BYTES))


Name = TypeVar("Name", bound=str)


class Leaving(NamedTuple, Generic[Name]):
    """A payload that leaves now: a whole one of `stream`, or a piece."""

    stream: Name
    payload: bytes
    is_piece: bool


class _Stream:
    """The waiting wholes of one stream; the first may have begun to leave."""

    def __init__(self) -> None:
        self.begun: bytes | None = None
        self.offset = 0
        self.waiting: deque[bytes] = deque()
        self.held_back = {"rate": 0, "queue": 0}

    @property
    def left_bytes(self) -> int:
        """Bytes that have not left yet."""
        begun = 0 if self.begun is None else len(self.begun) - self.offset
        return begun + sum(map(len, self.waiting))


class Budget(Generic[Name]):
    """Token bucket (its rate is the controller's) with strict priority: haptics, telemetry, then the `paced` streams.

    Haptics always leave and may put the bucket into debt. What is paced leaves where there is room. A whole that
    has begun is finished, one that has not gives way to a newer one.
    """

    def __init__(self, paced: Sequence[Name] = (), first_number: int = 0) -> None:
        """paced: streams that leave in pieces, the more urgent first. first_number: of the wholes."""
        self.controller = RateController()
        self._streams: dict[Name, _Stream] = {name: _Stream() for name in paced}
        self._number: dict[Name, int] = dict.fromkeys(paced, first_number)
        self._dropped = {"telemetry": {"rate": 0, "queue": 0}}
        self.level_bytes = 0.0
        """Bytes that may leave at once; below 0 a debt."""
        self._now_s: float | None = None
        self._telemetry_s = -math.inf
        self._flows_s = math.inf
        """When nothing waited for the rate last"""
        self._haptic_bytes = _TYPICAL_BYTES
        self._must_bit_s = 0.0
        """Bits a second of haptics and telemetry, smoothed."""
        self._heard_from: OutgoingQueue | None = None
        self._measured: OutgoingQueue | None = None
        """The last peer's queue."""

    def hear(self, queue: OutgoingQueue | None, now_s: float) -> None:
        """Take the echoes that have arrived from the present peer; None: there is no peer that echoes."""
        if queue is not self._heard_from:
            self._heard_from, self._measured = queue, queue or self._measured
            self.controller = RateController()
        for echo in [] if queue is None else queue.take():
            self.controller.heard(echo, now_s)

    def spend(self, stream: Name | Literal["haptics", "telemetry"], size_bytes: int, now_s: float) -> None:
        """Count a payload that leaves now, whatever the budget says."""
        self._fill(now_s)
        taken = on_the_wire(size_bytes)
        self.controller.sent(taken, now_s, _URGENCY.get(stream, Urgency.PACED))
        self.level_bytes = max(self.level_bytes - taken, -_DEBT_S * self.controller.rate_bit_s / 8.0)
        if stream not in self._streams:
            self._must_bit_s += 8.0 * taken / _SMOOTHING_S
        if stream == "haptics":
            self._haptic_bytes += (taken - self._haptic_bytes) / 64.0

    def may_tell(self, size_bytes: int, now_s: float) -> bool:
        """Return True and count it if telemetry of that size leaves now; if not, the next one is newer."""
        self._fill(now_s)
        flows = self.controller.may_send(now_s)
        if (flows and self.level_bytes > 0.0) or now_s - self._telemetry_s >= _SELDOM_S:
            self._telemetry_s = now_s
            self.spend("telemetry", size_bytes, now_s)
            return True
        self._dropped["telemetry"]["rate" if flows else "queue"] += 1
        return False

    def offer(self, stream: Name, payload: bytes, now_s: float) -> None:
        """Let a payload of a paced stream wait for its turn."""
        one = self._streams[stream]
        one.waiting.append(payload)
        if len(one.waiting) > _WAITING:
            one.waiting.popleft()
            one.held_back["rate" if self.controller.may_send(now_s) else "queue"] += 1

    def take(self, now_s: float) -> list[Leaving[Name]]:
        """Take what leaves at `now_s` of the paced streams. To be called every millisecond or so."""
        self._fill(now_s)
        leaving: list[Leaving[Name]] = []
        for name, stream in self._streams.items():
            while (size_bytes := self._next_bytes(stream)) and self.controller.may_send(now_s):
                # A piece may be larger than the bucket by a quarter; then a full one will do.
                if self.level_bytes < min(on_the_wire(size_bytes), self._depth_bytes):
                    break
                leaving.append(self._next(name, stream, size_bytes))
                self.spend(name, len(leaving[-1].payload), now_s)
        # Only now: where haptics leave in every turn, the bucket would never be full.
        self.level_bytes = min(self.level_bytes, self._depth_bytes)
        if not self.controller.may_send(now_s) or not any(stream.left_bytes for stream in self._streams.values()):
            self._flows_s = now_s
        self.controller.update(now_s, limited=now_s - self._flows_s > SLICE_S)
        return leaving

    def _next_bytes(self, stream: _Stream) -> int:
        """Bytes of the next piece; 0 while nothing waits. A last one would be no crumb: it goes with the one before."""
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
        """How long what is offered to `stream` now would wait; endless where a whole of it has not begun to leave.

        Who waits for less before making another one never sees one give way: of pictures that each say what has
        changed since the one before, all have to arrive.
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
        """Bits a second that haptics and telemetry leave of the rate, at least a twentieth of it."""
        rate_bit_s = self.controller.rate_bit_s
        return max(rate_bit_s - self._must_bit_s, 0.05 * rate_bit_s)

    @property
    def haptic_interval_s(self) -> float:
        """The least time between two haptic messages to a peer: 0 until the link shows a limit, 20 ms in a queue."""
        if self.controller.drains:
            return KEEP_ALIVE_S
        if self.controller.begins:
            return 0.0
        return min(8.0 * self._haptic_bytes / (_SHARE * self.controller.rate_bit_s), KEEP_ALIVE_S)

    def held_back(self) -> dict[str, dict[str, int]]:
        """Count the messages of each stream that gave way to the `rate`, or while a `queue` went away."""
        paced: dict[str, dict[str, int]] = {name: dict(stream.held_back) for name, stream in self._streams.items()}
        return self._dropped | paced

    def status(self) -> dict[str, float]:
        """`queue_ms` and `rate_kbit_s` as they are now."""
        return {"queue_ms": 1e3 * self.controller.queue_s, "rate_kbit_s": 1e-3 * self.controller.rate_bit_s}

    def summary(self) -> dict[str, Any]:
        """`allowed_kbit_s`, `queue_ms` with p50 and p95, and what was `held_back`."""
        queue = {"p50": None, "p95": None} if self._measured is None else self._measured.summary_ms()
        return {
            "allowed_kbit_s": 1e-3 * self.controller.rate_bit_s,
            "queue_ms": queue,
            "held_back": self.held_back(),
        }
