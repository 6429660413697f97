"""One end of a link to one peer: stamps what leaves, and orders and measures what arrives."""

import hashlib
from collections import deque
from dataclasses import dataclass
from typing import Any, Literal

from common.protocol.messages import AnyMessage, Header, Hello
from common.rate.outgoing_queue import OutgoingQueue
from common.silence import counted_s
from common.statistics import RunningStatistics
from common.timing.ages import QueueingAge
from common.timing.clock_offset import ClockOffset

_GAP_S = 0.1
_REMEMBERED_EPOCHS = 64
"""Epochs that have ended and may not come back; the oldest are forgotten so that memory stays bounded."""
_MOST_RECENT = 4096
"""Arrivals whose delays are kept for who looks at the last second."""
_MOST_UNMEASURED = 4096
"""Arrivals that wait for the offset to settle: it takes a second, in which a thousand or so arrive."""


@dataclass(frozen=True)
class Arrival:
    """What the stamps of one message say at the moment it arrived."""

    fresh: bool
    """Newer than all that came before of its kind, in the peer's present epoch: it may be applied."""
    queueing_age_s: float
    """Its one-way delay beyond the sliding minimum: what a queue added, whatever the distance."""
    one_way_s: float | None
    """Its delay from the peer, as uncertain as the clock offset; None while that is unknown."""
    loop_age_s: float | None
    """Since we sent the stamp that it echoes: both ways, and of the holding what counts (common/silence.py). None
    before the first echo."""
    copy: bool = False
    """The newest of its kind once more, by another connection."""


class LinkEnd:
    """Epoch, sequence numbers, echoes and delay statistics towards one peer.

    Latest wins and never twice: of each kind of message only a higher sequence number of the present epoch is
    fresh. An epoch begins with the peer's Hello; one that has ended is refused for good.
    """

    def __init__(
        self,
        side: Literal["operator", "robot"],
        epoch: int,
        clock_domain: str,
        seed: int = 0,
        asymmetry_s: float = 0.0,
    ) -> None:
        """`asymmetry_s`: the least delay to the robot minus that to the operator, where it is known otherwise."""
        self.delay = RunningStatistics(seed)
        """One-way delay from the peer in seconds, every arrival, before ordering; empty until the offset settles."""
        self.round_trip = RunningStatistics(seed)
        """Both ways without the peer's holding time, in seconds, every arrival that echoes a stamp."""
        self.recent: deque[tuple[float, float | None, float | None]] = deque(maxlen=_MOST_RECENT)
        """(now_s, one-way delay from the peer, round trip) of the newest arrivals in seconds, the oldest first."""
        self.outgoing = OutgoingQueue(seed)
        """The queue in front of what we send to the peer."""
        self.stale = 0
        """Messages that came too late to be applied, or of no known epoch."""
        self.gaps = 0
        """Silences of more than 100 ms that something newer ended."""
        self._side = side
        self._epoch = epoch
        self._clock_domain = clock_domain
        self._to_peer_asymmetry_s = asymmetry_s if side == "operator" else -asymmetry_s
        self._sequence = 0
        self._ended_epochs: list[int] = []
        self._forget_peer(None, shared_clock=False)

    def _forget_peer(self, epoch: int | None, *, shared_clock: bool) -> None:
        self.peer_epoch = epoch
        self.clock_offset = ClockOffset(shared_clock=shared_clock, asymmetry_s=self._to_peer_asymmetry_s)
        """What the peer's clock is ahead of ours; another one in each of its epochs."""
        self._jumps = 0
        self.outgoing.reset()
        self._unmeasured: deque[tuple[float, float]] = deque(maxlen=_MOST_UNMEASURED)
        self._queueing = QueueingAge()
        self._newest_of_kind: dict[type, int] = {}
        self._newest: Header | None = None
        self._newest_received_s = 0.0
        self._last_sent_s = self._last_received_s = 0.0

    def begin_anew(self) -> None:
        """Another epoch of ours, after the peer took this one for ended; only who knows this one can guess it."""
        self._epoch = int.from_bytes(hashlib.sha256(self._epoch.to_bytes(8)).digest()[:8]) >> 11

    def hello(self, now_s: float, sequence: int | None = None) -> Hello:
        """The message that opens our epoch; `sequence` as for `stamp`."""
        return Hello(self.stamp(now_s, sequence), side=self._side, clock_domain=self._clock_domain)

    def stamp(self, now_s: float, sequence: int | None = None) -> Header:
        """The header of the next message, to be made when it enters its delay line.

        `sequence`: its number, of whoever counts over several ends of one epoch; None for the next of our own.
        """
        if sequence is None:
            self._sequence = sequence = self._sequence + 1
        newest = self._newest
        if newest is None:
            return Header(self._epoch, sequence, now_s)
        held_s = now_s - self._newest_received_s
        if self._last_sent_s == newest.sent_s:
            return Header(self._epoch, sequence, now_s, newest.sent_s, held_s)
        return Header(
            self._epoch,
            sequence,
            now_s,
            newest.sent_s,
            held_s,
            last_sent_s=self._last_sent_s,
            last_held_s=now_s - self._last_received_s,
        )

    def expect_other_delay(self) -> None:
        """The peer's link was changed on purpose: what queues is judged by what comes from now on."""
        self._queueing.reset()
        self.outgoing.reset()

    def arrived(self, message: AnyMessage, now_s: float) -> Arrival:
        """Measure and order one message from the peer."""
        header = message.header
        if isinstance(message, Hello) and header.epoch != self.peer_epoch:
            self._begin_epoch(message)
        if header.epoch != self.peer_epoch:
            self.stale += 1
            return Arrival(fresh=False, queueing_age_s=0.0, one_way_s=None, loop_age_s=None)
        loop_age_s = self._measure_loop(header, now_s)
        one_way_s = self._measure_one_way(header.sent_s, now_s)
        self.recent.append((now_s, one_way_s, self.clock_offset.round_trip_s))
        queueing_age_s = self._queueing.update(header.sent_s, now_s)
        if self._newest is None or header.sequence > self._newest.sequence:
            self.gaps += self._newest is not None and now_s - self._newest_received_s > _GAP_S
            self._newest, self._newest_received_s = header, now_s
        self._last_sent_s, self._last_received_s = header.sent_s, now_s
        newest = self._newest_of_kind.get(type(message), 0)
        fresh, copy = header.sequence > newest, header.sequence == newest
        if fresh:
            self._newest_of_kind[type(message)] = header.sequence
        self.stale += not fresh and not copy
        return Arrival(fresh, queueing_age_s, one_way_s, loop_age_s, copy)

    def _begin_epoch(self, hello: Hello) -> None:
        epoch = hello.header.epoch
        if epoch in self._ended_epochs:
            return
        if self.peer_epoch is not None:
            self._ended_epochs = [*self._ended_epochs, self.peer_epoch][-_REMEMBERED_EPOCHS:]
        shared = self._clock_domain != "" and hello.clock_domain == self._clock_domain
        self._forget_peer(epoch, shared_clock=shared)

    def _measure_loop(self, header: Header, now_s: float) -> float | None:
        """Take in the stamps that came with a message; the loop age that they give."""
        sent_s, held_s = header.echo_sent_s, header.echo_held_s
        if sent_s is None or held_s is None:
            self.clock_offset.arrived(header.sent_s, now_s)
            return None
        last = header.last_sent_s is None
        # A stamp from before our own restart, or a peer that invents one, says nothing about the link.
        if not self.clock_offset.update(sent_s, header.sent_s, held_s, now_s, arrived_last=last):
            return None
        self.outgoing.echoed(sent_s, header.sent_s - held_s)
        if header.last_sent_s is not None and header.last_held_s is not None:
            self.clock_offset.overtaken(header.last_sent_s, header.sent_s, header.last_held_s, now_s)
        if self.clock_offset.round_trip_s is not None:
            self.round_trip.add(self.clock_offset.round_trip_s)
        return max(0.0, now_s - sent_s - held_s) + counted_s(held_s)

    def _measure_one_way(self, sent_s: float, now_s: float) -> float | None:
        if self.clock_offset.jumps != self._jumps:
            # The peer's clock counts from another origin now, and old delays cannot be told any more.
            self._jumps = self.clock_offset.jumps
            self._queueing.reset()
            self.outgoing.reset()
            self._unmeasured.clear()
        one_way_s = self.clock_offset.one_way_from_peer_s(sent_s, now_s)
        if one_way_s is None or not self.clock_offset.settled:
            self._unmeasured.append((sent_s, now_s))
            return one_way_s
        while self._unmeasured:
            earlier_s = self.clock_offset.one_way_from_peer_s(*self._unmeasured.popleft())
            if earlier_s is not None:
                self.delay.add(earlier_s)
        self.delay.add(one_way_s)
        return one_way_s

    def offset_summary_ms(self) -> dict[str, Any]:
        """What the peer's clock is ahead of ours: `value` and `bound` in ms, `skew_ppm`, the `estimator` behind it,
        and how many stamps were `rejected` and clock `jumps` seen; None where unknown.
        """
        offset = self.clock_offset
        value_s, bound_s, skew = offset.offset_s, offset.bound_s, offset.skew
        return {
            "value": None if value_s is None else 1e3 * value_s,
            "bound": None if bound_s is None else 1e3 * bound_s,
            "skew_ppm": None if skew is None else 1e6 * skew,
            "estimator": offset.estimator,
            "rejected": offset.rejected,
            "jumps": offset.jumps,
        }
