"""Clock offset of the peer, estimated from the stamps of ordinary messages."""

import math

from common.timing.offset_interval import OffsetInterval

MAX_SKEW = 600e-6
"""Largest skew of two clocks: 500 ppm while a time daemon slews a clock (adjtime), plus 100 ppm between crystals."""
_CONTRADICTIONS = 8
"""Number of successive contradictory stamps, in one direction, that mean a clock jump."""
_LONGEST_S = 1000.0
"""Longest possible delay, in seconds. Stamps that imply more are invalid."""
ROUNDING = 1e-15
"""Relative rounding error of four operations on stamps."""
_WINDOW_S = 10.0
"""Stamps older than once to twice this time, in seconds, are forgotten."""
_SETTLED_S = 1.0


class ClockOffset:
    """Estimate of clock offset and one-way delays, with a bound on the offset's error.

    The estimate is the middle of the interval that the least delays of both directions allow, because queues leave a
    minimum unchanged. It cannot detect unequal delays of the two directions; half of the difference enters the offset.
    `asymmetry_s`, the least delay to the peer minus the least delay from the peer, corrects the estimate, not the
    bound. The bound holds while the clocks' skew is within MAX_SKEW. Two processes that read the same clock
    (`shared_clock`) have the offset 0.

    A clock jump, as after a suspend, restarts the estimate if it is longer than the least round trip: then messages
    seem to arrive before they were sent. A shorter jump is forgotten after 20 s. Only until then the bound may be
    wrong.
    """

    def __init__(self, *, shared_clock: bool, asymmetry_s: float = 0.0) -> None:
        if not math.isfinite(asymmetry_s):
            raise ValueError(f"asymmetry_s = {asymmetry_s}; valid: a finite time")
        self.round_trip_s: float | None = None
        """Newest round trip, without the time for which the peer held our stamp; None before the first."""
        self.rejected = 0
        """Number of rejected stamps: impossible by themselves, or in contradiction to all earlier ones."""
        self.jumps = 0
        """Number of clock jumps found."""
        self._shared_clock = shared_clock
        self._asymmetry_s = asymmetry_s
        self._start_anew(-math.inf)

    def _start_anew(self, now_s: float) -> None:
        self._since_s, self._now_s = now_s, -math.inf
        self._interval, self._next = OffsetInterval(MAX_SKEW), OffsetInterval(MAX_SKEW)
        self._known_since_s, self._next_since_s = math.inf, now_s
        self._echoed_s = math.nan
        self._contradictions_to = self._contradictions_from = 0

    def update(self, local_sent_s: float, peer_sent_s: float, peer_held_s: float, local_received_s: float) -> bool:
        """Add one exchange: our stamp, which the peer held for `peer_held_s` and echoed in a message.

        `peer_sent_s` is on the peer's clock, `local_sent_s` and `local_received_s` are on ours. Return False, and count
        in `rejected`, if the holding time is negative or longer than the whole exchange.
        """
        round_trip_s = local_received_s - local_sent_s - peer_held_s
        # Two clocks measure the round trip and the holding time, and differ by their skew.
        allowed_s = MAX_SKEW * peer_held_s + 2.0 * ROUNDING * abs(local_received_s)
        if not (math.isfinite(peer_sent_s) and peer_held_s >= 0.0 and -allowed_s <= round_trip_s < _LONGEST_S):
            self.rejected += 1
            return False
        self.round_trip_s = max(0.0, round_trip_s)
        self.arrived(peer_sent_s, local_received_s)
        # Our clock may have jumped since we sent a message that is still under way.
        if self._shared_clock or local_sent_s == self._echoed_s or local_sent_s < self._since_s:
            return True
        self._echoed_s = local_sent_s
        offset_s, margin_s = peer_sent_s - peer_held_s - local_sent_s, self._margin(peer_sent_s, local_received_s)
        agrees = [one.bound_above(offset_s, local_sent_s, margin_s) for one in (self._interval, self._next)]
        self._contradictions_to = self._judge(agrees[0], self._contradictions_to, local_received_s)
        return True

    def arrived(self, peer_sent_s: float, local_received_s: float) -> None:
        """Add the stamps of a message without an echo; `update` calls it for messages with one."""
        if self._shared_clock:
            return
        if not (math.isfinite(peer_sent_s) and math.isfinite(local_received_s)):
            self.rejected += 1
            return
        self._advance(local_received_s)
        offset_s, margin_s = peer_sent_s - local_received_s, self._margin(peer_sent_s, local_received_s)
        agrees = [one.bound_below(offset_s, margin_s) for one in (self._interval, self._next)]
        self._contradictions_from = self._judge(agrees[0], self._contradictions_from, local_received_s)

    def _advance(self, now_s: float) -> None:
        """Loosen the bounds up to `now_s`, and forget the older interval when the newer has lasted long enough."""
        self._now_s = max(self._now_s, now_s)
        self._interval.advance(now_s)
        self._next.advance(now_s)
        self._known_since_s = min(self._known_since_s, now_s) if self._interval.bounded else math.inf
        if self._next.bounded and now_s - self._next_since_s > _WINDOW_S:
            self._interval, self._next, self._next_since_s = self._next, OffsetInterval(MAX_SKEW), now_s
            self._next.advance(now_s)

    def _judge(self, agrees: bool, contradictions: int, now_s: float) -> int:
        """Return how many successive stamps contradicted earlier ones; after a few of them start anew."""
        if agrees:
            return 0
        self.rejected += 1
        if contradictions + 1 < _CONTRADICTIONS:
            return contradictions + 1
        self.jumps += 1
        self._start_anew(now_s)
        return 0

    @staticmethod
    def _margin(peer_s: float, local_s: float) -> float:
        return ROUNDING * (abs(peer_s) + abs(local_s))

    def offset_at(self, now_s: float) -> float | None:
        """Return the peer's clock minus ours, in seconds, at `now_s` on our clock; None while unknown or in doubt."""
        if self._shared_clock:
            return 0.0
        if self._contradictions_to or self._contradictions_from or not self._interval.bounded:
            return None
        least_s, greatest_s = self._interval.at(now_s)
        return min(max((least_s + greatest_s - self._asymmetry_s) / 2.0, least_s), greatest_s)

    def bound_at(self, now_s: float) -> float | None:
        """Return the largest possible error of `offset_at`, in seconds, whatever the delays are; None while unknown.

        The bound is half the least round trip if the offset lies in the middle of the possible interval, else more.
        """
        offset_s = self.offset_at(now_s)
        if offset_s is None or self._shared_clock:
            return offset_s
        least_s, greatest_s = self._interval.at(now_s)
        # Add the rounding error of the caller's sums with stamps.
        return max(greatest_s - offset_s, offset_s - least_s) + self._margin(now_s + offset_s, now_s)

    @property
    def offset_s(self) -> float | None:
        """`offset_at` the time of the newest arrival."""
        return self.offset_at(self._now_s)

    @property
    def bound_s(self) -> float | None:
        """`bound_at` the time of the newest arrival."""
        return self.bound_at(self._now_s)

    @property
    def settled(self) -> bool:
        """Whether the offset is estimated from at least about a second of messages both ways."""
        return self._shared_clock or self._now_s - self._known_since_s >= _SETTLED_S

    def one_way_from_peer_s(self, peer_sent_s: float, local_received_s: float) -> float | None:
        """Return the one-way delay of a message from the peer, in seconds; None while the offset is unknown.

        The delay is as uncertain as the offset. It is never below 0 for stamps that were accepted.
        """
        offset_s = self.offset_at(local_received_s)
        return None if offset_s is None else local_received_s - (peer_sent_s - offset_s)
