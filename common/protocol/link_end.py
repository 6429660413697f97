"""One end of a link to one peer: stamps outgoing messages; orders and measures incoming ones."""

import hashlib
from collections import deque
from dataclasses import dataclass
from typing import Any, Literal

from common.periods import TURN_S
from common.protocol.messages import AnyMessage, Header, Hello
from common.rate.outgoing_queue import OutgoingQueue
from common.silence import counted_s
from common.statistics import RunningStatistics
from common.timing.ages import QueueingAge
from common.timing.clock_offset import ClockOffset

_GAP_S = 0.1
_REMEMBERED_EPOCHS = 64
"""Number of the peer's ended epochs that are remembered, and so refused; older ones are forgotten to bound memory."""
_REMEMBERED_NUMBERS = 1024
"""Number of sequence numbers, up to the newest of a kind, of which is known whether they came: 2 to 4 s."""
_MOST_RECENT = 4096
"""Maximum number of arrivals in `recent`; enough for the last second."""


@dataclass(frozen=True)
class Arrival:
    """Order and delays of one received message, computed from its stamps."""

    fresh: bool
    """Whether the message is newer than all others of its kind in the peer's present epoch; only then it is applied."""
    queueing_age_s: float
    """Queueing delay in seconds: one-way delay above its sliding minimum."""
    one_way_s: float | None
    """One-way delay from the peer, as uncertain as the clock offset; None while the offset is unknown."""
    loop_age_s: float | None
    """Loop age in seconds: round trip of the echoed stamp, plus the counted part of the time for which the peer held
    that stamp (common/silence.py). None if the message echoes no valid stamp."""
    copy: bool = False
    """Whether the message came before, over another connection; known of the newest 1024 numbers of its kind."""


@dataclass
class _Numbers:
    """Sequence numbers of one kind that came: the newest, and which before it."""

    newest: int = 0
    came: int = 1
    """Bit i: whether number `newest` - i came"""

    def note(self, sequence: int) -> tuple[bool, bool]:
        """Note that `sequence` came; return whether it is newer than all before, and whether it came before."""
        ahead = sequence - self.newest
        if ahead > 0:
            # An invented number may be very far ahead.
            kept = self.came << ahead if ahead < _REMEMBERED_NUMBERS else 0
            self.newest, self.came = sequence, kept % (1 << _REMEMBERED_NUMBERS) | 1
            return True, False
        came_before = bool(self.came >> -ahead & 1)
        if -ahead < _REMEMBERED_NUMBERS:
            self.came |= 1 << -ahead
        return False, came_before


class LinkEnd:
    """Epoch, sequence numbers, echoes and delay statistics towards one peer.

    Latest wins: a message is fresh only if its sequence number in the present epoch exceeds all earlier ones of its
    kind. An epoch begins with the peer's Hello, and ends with a Hello of another epoch. Later messages of an ended
    epoch are refused.
    """

    def __init__(
        self,
        side: Literal["operator", "robot"],
        epoch: int,
        clock_domain: str,
        seed: int = 0,
        asymmetry_s: float = 0.0,
        turn_s: float = TURN_S,
    ) -> None:
        """`asymmetry_s`: least delay to the robot minus least delay to the operator, if known from elsewhere.

        turn_s: period of turns, which the peer is taken to have, too.
        """
        self.delay = RunningStatistics(seed)
        """One-way delays from the peer in seconds, of all arrivals since the offset settled, fresh or not."""
        self.round_trip = RunningStatistics(seed)
        """Round trips without the peer's holding time, in seconds, of all arrivals that echo a stamp."""
        self.recent: deque[tuple[float, float | None, float | None]] = deque(maxlen=_MOST_RECENT)
        """(now_s, one-way delay from the peer, round trip) of the newest arrivals in seconds, oldest first."""
        self.outgoing = OutgoingQueue(seed)
        """Estimate of the queue in front of our messages to the peer."""
        self.stale = 0
        """Number of messages that were older than the newest of their kind, or not of the peer's present epoch."""
        self.gaps = 0
        """Number of silences of more than 100 ms between two messages, each newer than all before."""
        self.turn_s = turn_s
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
        """Estimate of the peer's clock offset; begun anew with each epoch of the peer."""
        self._jumps = 0
        self.outgoing.reset()
        self._queueing = QueueingAge()
        self._numbers_of_kind: dict[type, _Numbers] = {}
        self._newest: Header | None = None
        self._newest_received_s = 0.0
        self._last_sent_s = self._last_received_s = 0.0

    def begin_epoch(self) -> None:
        """Begin our next epoch after the peer ended the present one; strangers cannot guess its number, a hash."""
        self._epoch = int.from_bytes(hashlib.sha256(self._epoch.to_bytes(8)).digest()[:8]) >> 11

    def hello(self, now_s: float, sequence: int | None = None) -> Hello:
        """Return the message that opens our epoch; `sequence` as for `stamp`."""
        return Hello(self.stamp(now_s, sequence), side=self._side, clock_domain=self._clock_domain)

    def stamp(self, now_s: float, sequence: int | None = None) -> Header:
        """Return the header of the next message; call it when the message enters its delay line.

        `sequence`: the message's number, if the caller counts the messages of several LinkEnds of one epoch together.
        None: the next number of this LinkEnd.
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
        """Forget the least delays after the emulated link was changed on purpose; new arrivals give new ones."""
        self._queueing.reset()
        self.outgoing.reset()

    def arrived(self, message: AnyMessage, now_s: float) -> Arrival:
        """Note one received message: compute its delays, and whether it is fresh."""
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
        fresh, copy = self._numbers_of_kind.setdefault(type(message), _Numbers()).note(header.sequence)
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
        """Update the estimates from a message's stamps; return its loop age, None without a valid echo."""
        sent_s, held_s = header.echo_sent_s, header.echo_held_s
        if sent_s is None or held_s is None:
            self.clock_offset.arrived(header.sent_s, now_s)
            return None
        # A stamp from before our restart, or an invented one, says nothing about the link.
        if not self.clock_offset.update(sent_s, header.sent_s, held_s, now_s):
            return None
        self.outgoing.echoed(sent_s, header.sent_s - held_s)
        if header.last_sent_s is not None and header.last_held_s is not None:
            # Without the message that a newer one overtook, round trips would be biased low on a link that reorders.
            self.clock_offset.update(header.last_sent_s, header.sent_s, header.last_held_s, now_s)
        if self.clock_offset.round_trip_s is not None:
            self.round_trip.add(self.clock_offset.round_trip_s)
        return max(0.0, now_s - sent_s - held_s) + counted_s(held_s, self.turn_s)

    def _measure_one_way(self, sent_s: float, now_s: float) -> float | None:
        if self.clock_offset.jumps != self._jumps:
            # The peer's clock counts from another origin now: old delays are meaningless.
            self._jumps = self.clock_offset.jumps
            self._queueing.reset()
            self.outgoing.reset()
        one_way_s = self.clock_offset.one_way_from_peer_s(sent_s, now_s)
        if one_way_s is not None and self.clock_offset.settled:
            self.delay.add(one_way_s)
        return one_way_s

    def offset_summary_ms(self) -> dict[str, Any]:
        """Return the offset's `value` and `bound` in ms, and how many stamps were `rejected` and `jumps` found."""
        offset = self.clock_offset
        value_s, bound_s = offset.offset_s, offset.bound_s
        return {
            "value": None if value_s is None else 1e3 * value_s,
            "bound": None if bound_s is None else 1e3 * bound_s,
            "rejected": offset.rejected,
            "jumps": offset.jumps,
        }
