"""Clock offset of the peer, estimated from the stamps of ordinary messages."""

import math
from typing import Literal

from common.timing.offset_interval import OffsetInterval
from common.timing.offset_tracking import OffsetTracking

Estimator = Literal["shared clock", "interval", "lower envelope", "mean"]

MAX_SKEW = 600e-6
"""Largest skew of two clocks: 500 ppm while a time daemon slews a clock (adjtime), plus 100 ppm between crystals."""
_CONTRADICTIONS = 8
"""Number of successive contradictory stamps, in one direction, that mean a clock jump."""
_LONGEST_S = 1000.0
"""Longest possible delay, in seconds. Stamps that imply more are invalid, and must not enter any sum."""
_REMEMBERED_ECHOES = 1024
"""Number of remembered stamps that were echoed: one second's at 1 kHz. A stamp echoed again later counts twice."""
_ROUNDING = 1e-15
"""Relative rounding error of four operations on stamps."""


class ClockOffset:
    """Estimate of clock offset, skew and one-way delays, with a bound on the offset's error.

    The estimate uses the lower envelope of the delays both ways, because queues leave a minimum unchanged. If the
    delays of both directions have a symmetric distribution, it uses their mean, because symmetric jitter has no clear
    minimum. Neither method detects unequal delays of the two directions; half of the difference enters the offset.
    `asymmetry_s`, the least delay to the peer minus the least delay from the peer, corrects the estimate, not the
    bound. The bound holds while the clocks' skew is within `max_skew`. Two processes that read the same clock
    (`shared_clock`) have the offset 0.

    A clock jump, as after a suspend, restarts the estimate. A jump is found at once if messages seem to arrive before
    they were sent. To find a smaller one takes three blocks of time (2.4 s on a link that has been up for a minute).
    Only until then the bound may be wrong.
    """

    def __init__(self, *, shared_clock: bool, asymmetry_s: float = 0.0, max_skew: float = MAX_SKEW) -> None:
        if not math.isfinite(asymmetry_s):
            raise ValueError(f"asymmetry_s = {asymmetry_s}; valid: a finite time")
        if not 0.0 < max_skew < 0.01:
            raise ValueError(f"max_skew = {max_skew}; valid: above 0 to below 0.01")
        self.round_trip_s: float | None = None
        """Newest round trip, without the time for which the peer held our stamp; None before the first."""
        self.rejected = 0
        """Number of rejected stamps: impossible by themselves, or in contradiction to all earlier ones."""
        self.jumps = 0
        """Number of clock jumps found."""
        self._shared_clock = shared_clock
        self._asymmetry_s = asymmetry_s
        self._max_skew = max_skew
        self._start_anew(-math.inf)

    def _start_anew(self, now_s: float) -> None:
        self._since_s = now_s
        # Clocks may differ by days, and jitter is microseconds: all sums count from an origin on each clock.
        self._origin_s: float | None = None
        self._peer_origin_s = 0.0
        self._now_s = 0.0
        self._tracking = OffsetTracking()
        self._interval = OffsetInterval(self._max_skew)
        self._echoed_s = math.nan
        self._echoed_fairly_s: dict[float, None] = {}  # in order of insertion
        self._contradictions_to = self._contradictions_from = 0

    def update(
        self,
        local_sent_s: float,
        peer_sent_s: float,
        peer_held_s: float,
        local_received_s: float,
        *,
        arrived_last: bool = True,
    ) -> bool:
        """Add one exchange: our stamp, which the peer held for `peer_held_s` and echoed in a message.

        `peer_sent_s` is on the peer's clock, `local_sent_s` and `local_received_s` are on ours. `arrived_last` is False
        if an older stamp of ours arrived after this one: then this stamp was early, and no fair sample of the delay.
        Return False, and count in `rejected`, if the holding time is negative or longer than the whole exchange.
        """
        round_trip_s = local_received_s - local_sent_s - peer_held_s
        if not self._is_possible(round_trip_s, peer_sent_s, peer_held_s, local_received_s):
            return False
        self.round_trip_s = max(0.0, round_trip_s)
        self.arrived(peer_sent_s, local_received_s)
        if not self._shared_clock and local_sent_s != self._echoed_s:
            self._echoed_s = local_sent_s
            self._take_to_peer(local_sent_s, peer_sent_s - peer_held_s, local_received_s, fair=arrived_last)
        return True

    def overtaken(self, local_sent_s: float, peer_sent_s: float, peer_held_s: float, local_received_s: float) -> bool:
        """Add the exchange of the stamp of ours that arrived last at the peer, if a newer stamp overtook it.

        Parameters and result are those of `update`. Call it after `update` with the same message's newest stamp.
        Without it delays to the peer would be biased low on a link that reorders: overtaken messages would never be
        echoed.
        """
        round_trip_s = local_received_s - local_sent_s - peer_held_s
        if not self._is_possible(round_trip_s, peer_sent_s, peer_held_s, local_received_s):
            return False
        self.round_trip_s = max(0.0, round_trip_s)
        if not self._shared_clock:
            self._take_to_peer(local_sent_s, peer_sent_s - peer_held_s, local_received_s, fair=True)
        return True

    def _is_possible(self, round_trip_s: float, peer_sent_s: float, held_s: float, received_s: float) -> bool:
        # Two clocks measure the round trip and the holding time, and differ by their skew.
        allowed_s = self._max_skew * held_s + 2.0 * _ROUNDING * abs(received_s)
        if math.isfinite(peer_sent_s) and held_s >= 0.0 and -allowed_s <= round_trip_s < _LONGEST_S:
            return True
        self.rejected += 1
        return False

    def arrived(self, peer_sent_s: float, local_received_s: float) -> None:
        """Add the stamps of a message without an echo; `update` calls it for messages with one."""
        if self._shared_clock:
            return
        if not (math.isfinite(peer_sent_s) and math.isfinite(local_received_s)):
            self.rejected += 1
            return
        if self._origin_s is not None and self._tracking.advance(local_received_s - self._origin_s, self._max_skew):
            self._jumped(local_received_s)
        if self._origin_s is None:
            self._origin_s, self._peer_origin_s = local_received_s, peer_sent_s
        now_s = local_received_s - self._origin_s
        self._now_s = max(self._now_s, now_s)
        self._interval.advance(now_s)
        difference_s = now_s - (peer_sent_s - self._peer_origin_s)
        possible = abs(difference_s) < _LONGEST_S
        if possible and self._interval.take_least(-difference_s, self._margin(peer_sent_s, local_received_s)):
            self._contradictions_from = 0
            self._tracking.from_peer.add(now_s, difference_s)
            return
        self.rejected += 1
        self._contradictions_from += 1
        if self._contradictions_from >= _CONTRADICTIONS:
            self._jumped(local_received_s)

    def _take_to_peer(self, local_sent_s: float, peer_received_s: float, now_s: float, *, fair: bool) -> None:
        if fair:
            # Each of our stamps counts once, for any number and order of messages that echo it.
            seen = self._echoed_fairly_s
            if local_sent_s in seen:
                return
            seen[local_sent_s] = None
            if len(seen) > _REMEMBERED_ECHOES:
                del seen[next(iter(seen))]
        # Our clock may have jumped since we sent a message that is still under way.
        if self._origin_s is None or local_sent_s < self._since_s:
            return
        sent_s = local_sent_s - self._origin_s
        difference_s = peer_received_s - self._peer_origin_s - sent_s
        possible = abs(difference_s) < _LONGEST_S
        if possible and self._interval.take_greatest(difference_s, sent_s, self._margin(peer_received_s, now_s)):
            self._contradictions_to = 0
            self._tracking.to_peer.add(sent_s, difference_s, fair=fair)
            return
        self.rejected += 1
        self._contradictions_to += 1
        if self._contradictions_to >= _CONTRADICTIONS:
            self._jumped(now_s)

    @staticmethod
    def _margin(peer_s: float, local_s: float) -> float:
        return _ROUNDING * (abs(peer_s) + abs(local_s))

    def _jumped(self, now_s: float) -> None:
        self.jumps += 1
        self._start_anew(now_s)

    def _relative_offset_s(self, now_s: float) -> float | None:
        """Return the offset of the clocks counted from their origins; None while unknown or in doubt.

        `now_s` is counted from the origin of our clock.
        """
        if self._contradictions_to or self._contradictions_from:
            return None
        least_s, greatest_s = self._interval.at(now_s)
        if greatest_s - least_s == math.inf:
            return None
        line = self._tracking.line
        likeliest_s = (least_s + greatest_s) / 2.0 if line is None else line.value(now_s)
        likeliest_s -= self._asymmetry_s / 2.0
        if likeliest_s < least_s:
            return least_s
        return greatest_s if likeliest_s > greatest_s else likeliest_s

    def offset_at(self, now_s: float) -> float | None:
        """Return the peer's clock minus ours, in seconds, at `now_s` on our clock; None while unknown or in doubt."""
        if self._shared_clock:
            return 0.0
        if self._origin_s is None:
            return None
        offset_s = self._relative_offset_s(now_s - self._origin_s)
        return None if offset_s is None else self._peer_origin_s - self._origin_s + offset_s

    def bound_at(self, now_s: float) -> float | None:
        """Return the largest possible error of `offset_at`, in seconds, whatever the delays are; None while unknown.

        The bound is half the least round trip if the offset lies in the middle of the possible interval, else more.
        """
        if self._shared_clock:
            return 0.0
        if self._origin_s is None:
            return None
        elapsed_s = now_s - self._origin_s
        offset_s = self._relative_offset_s(elapsed_s)
        if offset_s is None:
            return None
        least_s, greatest_s = self._interval.at(elapsed_s)
        # Add the rounding error of the caller's sums with stamps.
        rounding_s = self._margin(self._peer_origin_s + elapsed_s, now_s)
        return max(greatest_s - offset_s, offset_s - least_s) + rounding_s

    @property
    def offset_s(self) -> float | None:
        """`offset_at` the time of the newest arrival."""
        return self.offset_at(self._now_s + (self._origin_s or 0.0))

    @property
    def bound_s(self) -> float | None:
        """`bound_at` the time of the newest arrival."""
        return self.bound_at(self._now_s + (self._origin_s or 0.0))

    @property
    def skew(self) -> float | None:
        """Seconds that the peer's clock gains on ours in a second; None while unknown."""
        if self._shared_clock:
            return 0.0
        line = self._tracking.line
        return None if line is None else line.skew

    @property
    def estimator(self) -> Estimator | None:
        """Method by which the offset is estimated; None while the offset is unknown."""
        if self._shared_clock:
            return "shared clock"
        if self.offset_s is None:
            return None
        return "interval" if self._tracking.line is None else self._tracking.estimator

    @property
    def settled(self) -> bool:
        """Whether the offset is estimated from at least about a second of messages both ways."""
        return self._shared_clock or self._tracking.settled

    def one_way_from_peer_s(self, peer_sent_s: float, local_received_s: float) -> float | None:
        """Return the one-way delay of a message from the peer, in seconds; None while the offset is unknown.

        The delay is as uncertain as the offset. It is never below 0 for stamps that were accepted.
        """
        if self._shared_clock:
            return local_received_s - peer_sent_s
        if self._origin_s is None:
            return None
        now_s = local_received_s - self._origin_s
        offset_s = self._relative_offset_s(now_s)
        return None if offset_s is None else now_s - (peer_sent_s - self._peer_origin_s) + offset_s
