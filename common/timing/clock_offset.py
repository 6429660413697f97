"""What the peer's clock is ahead of ours, from the stamps that ordinary traffic carries."""

import math
from typing import Literal

from common.timing.offset_interval import OffsetInterval

Estimator = Literal["shared clock", "interval", "mean"]

MAX_SKEW = 600e-6
"""Two clocks drift apart by at most this share of time: 500 ppm while a time daemon slews one (adjtime), and 100 ppm
by which quartz crystals differ."""
_CONTRADICTIONS = 8
"""This many in a row in one direction mean that a clock has jumped."""
_LONGEST_S = 1000.0
"""No delay is longer."""
_LATEST_S = 1e12
"""No monotonic clock shows more: longer stamps were invented by a peer."""
_REMEMBERED_ECHOES = 1024
"""A second's stamps at 1 kHz; one that is echoed again after that counts twice, which does little harm."""
_ROUNDING = 1e-15
"""Relative error of the stamps after four operations."""
_TIME_CONSTANT_S = 5.0
"""Time constant of the running means: jitter of 10 ms averages out to 0.3 ms, a drift of 20 ppm adds 0.1 ms."""
_MEAN_SAMPLES = 500
"""A mean of fewer samples is not used."""
_SETTLED_S = 1.0
_ALIKE = 0.3
"""Both ways jitter alike when their mean delays above the least differ by less than this share of their sum."""


class _RunningMean:
    """The mean of about the last `_TIME_CONSTANT_S`, weighted exponentially."""

    def __init__(self) -> None:
        self.count = 0
        self.value = 0.0
        self._at_s = 0.0

    def add(self, value: float, now_s: float) -> None:
        self.count += 1
        weight = max(1.0 / self.count, min(1.0, (now_s - self._at_s) / _TIME_CONSTANT_S))
        self.value += (value - self.value) * weight
        self._at_s = now_s


class ClockOffset:
    """Offset and one-way delays, with a bound on the offset that holds while the clocks run within `max_skew`.

    The offset is the middle of the certain interval (Cristian's algorithm over all exchanges, with drift). Where both
    directions jitter alike it is the middle of their mean differences: symmetric jitter such as a normal one has no
    sharp floor. Neither sees how much longer one way is than the other: half of that difference goes into the offset,
    unless `asymmetry_s` says it: the least delay to the peer minus that from it. The bound does not trust it. Two
    processes that read the same clock (`shared_clock`) differ by exactly 0.

    A clock that jumps, as after a suspend, restarts the estimate as soon as messages seem to arrive before they were
    sent. A jump smaller than the round trip is followed by `max_skew` of time: until then the bound may be wrong.
    """

    def __init__(self, *, shared_clock: bool, asymmetry_s: float = 0.0, max_skew: float = MAX_SKEW) -> None:
        if not math.isfinite(asymmetry_s):
            raise ValueError(f"asymmetry_s = {asymmetry_s}; valid: a finite time")
        if not 0.0 < max_skew < 0.01:
            raise ValueError(f"max_skew = {max_skew}; valid: above 0 to below 0.01")
        self.round_trip_s: float | None = None
        """The newest exchange's time both ways without the peer's holding time, of the stamp that arrived last; None
        before the first."""
        self.rejected = 0
        """Stamps that contradict each other or all that was known."""
        self.jumps = 0
        """How often a clock was found to have jumped."""
        self._shared_clock = shared_clock
        self._asymmetry_s = asymmetry_s
        self._max_skew = max_skew
        self._restart(-math.inf)

    def _restart(self, now_s: float) -> None:
        self._since_s = now_s
        self._first_s = self._newest_s = self._newest_peer_s = 0.0
        self._interval = OffsetInterval(self._max_skew)
        self._to_peer, self._from_peer = _RunningMean(), _RunningMean()
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
        """Take in one exchange: our stamp, echoed by the peer in what it sent after holding it.

        `peer_sent_s` is by the peer's clock, `local_sent_s` and `local_received_s` are by ours. `arrived_last` is
        False when the peer chose the stamp for being our newest, while an older one arrived after it: then it is
        early, and no fair sample of the delay. False, and counted in `rejected`, when the holding time is negative
        or longer than the whole exchange.
        """
        if not self._take_round_trip(local_sent_s, peer_sent_s, peer_held_s, local_received_s):
            return False
        self.arrived(peer_sent_s, local_received_s)
        if not self._shared_clock and local_sent_s != self._echoed_s:
            self._echoed_s = local_sent_s
            self._take_to_peer(local_sent_s, peer_sent_s - peer_held_s, local_received_s, fair=arrived_last)
        return True

    def overtaken(self, local_sent_s: float, peer_sent_s: float, peer_held_s: float, local_received_s: float) -> bool:
        """Take in the stamp of ours that arrived last at the peer, where it is not the newest; as for `update`.

        Comes after `update` with the same message's newest stamp. Without it, every delay to the peer would seem
        shorter than it is on a link that reorders, because a message that was overtaken would never be echoed.
        """
        if not self._take_round_trip(local_sent_s, peer_sent_s, peer_held_s, local_received_s):
            return False
        if not self._shared_clock:
            self._take_to_peer(local_sent_s, peer_sent_s - peer_held_s, local_received_s, fair=True)
        return True

    def _take_round_trip(self, local_sent_s: float, peer_sent_s: float, held_s: float, received_s: float) -> bool:
        round_trip_s = received_s - local_sent_s - held_s
        # Two clocks measure the round trip and the holding, and may differ by their skew.
        allowed_s = self._max_skew * held_s + 2.0 * _ROUNDING * abs(received_s)
        if abs(peer_sent_s) < _LATEST_S and held_s >= 0.0 and -allowed_s <= round_trip_s < _LONGEST_S:
            self.round_trip_s = max(0.0, round_trip_s)
            return True
        self.rejected += 1
        return False

    def arrived(self, peer_sent_s: float, local_received_s: float) -> None:
        """Take in the stamps of a message that echoes none of ours; `update` does so by itself."""
        if self._shared_clock:
            return
        if not (abs(peer_sent_s) < _LATEST_S and math.isfinite(local_received_s)):
            self.rejected += 1
            return
        if not self._from_peer.count:
            self._first_s = local_received_s
        if local_received_s > self._newest_s or not self._from_peer.count:
            self._newest_s, self._newest_peer_s = local_received_s, peer_sent_s
        self._interval.advance(local_received_s)
        offset_s = peer_sent_s - local_received_s
        if self._interval.take_least(offset_s, _margin(peer_sent_s, local_received_s)):
            self._contradictions_from = 0
            self._from_peer.add(offset_s, local_received_s)
            return
        self.rejected += 1
        self._contradictions_from += 1
        if self._contradictions_from >= _CONTRADICTIONS:
            self._jumped(local_received_s)

    def _take_to_peer(self, local_sent_s: float, peer_received_s: float, now_s: float, *, fair: bool) -> None:
        if fair:
            # Each of our stamps counts once, however many messages echo it and in whatever order they come.
            seen = self._echoed_fairly_s
            if local_sent_s in seen:
                return
            seen[local_sent_s] = None
            if len(seen) > _REMEMBERED_ECHOES:
                del seen[next(iter(seen))]
        # Our clock may have jumped since we sent what is still on its way.
        if local_sent_s < self._since_s:
            return
        offset_s = peer_received_s - local_sent_s
        if self._interval.take_greatest(offset_s, local_sent_s, _margin(peer_received_s, now_s)):
            self._contradictions_to = 0
            if fair:
                self._to_peer.add(offset_s, now_s)
            return
        self.rejected += 1
        self._contradictions_to += 1
        if self._contradictions_to >= _CONTRADICTIONS:
            self._jumped(now_s)

    def _jumped(self, now_s: float) -> None:
        self.jumps += 1
        self._restart(now_s)

    def _symmetric(self, least_s: float, greatest_s: float) -> bool:
        """Say whether the means may be trusted: enough samples both ways, and alike above the least delays."""
        to_peer_s, from_peer_s = self._to_peer.value - greatest_s, least_s - self._from_peer.value
        enough = min(self._to_peer.count, self._from_peer.count) >= _MEAN_SAMPLES
        return enough and abs(to_peer_s - from_peer_s) < _ALIKE * (to_peer_s + from_peer_s)

    def offset_at(self, now_s: float) -> float | None:
        """The peer's clock minus ours at `now_s` by ours, in seconds; None while unknown or in doubt."""
        if self._shared_clock:
            return 0.0
        least_s, greatest_s = self._interval.at(now_s)
        if self._contradictions_to or self._contradictions_from or greatest_s - least_s == math.inf:
            return None
        twice_s = least_s + greatest_s
        if self._symmetric(least_s, greatest_s):
            twice_s = self._to_peer.value + self._from_peer.value
        return min(max((twice_s - self._asymmetry_s) / 2.0, least_s), greatest_s)

    def bound_at(self, now_s: float) -> float | None:
        """How far `offset_at` can be from the truth, in seconds, whatever the delays were; None while unknown.

        Half the least round trip where the offset lies in the middle of what is possible, and more where not.
        """
        offset_s = self.offset_at(now_s)
        if self._shared_clock or offset_s is None:
            return offset_s
        least_s, greatest_s = self._interval.at(now_s)
        # The caller's own sums with stamps are rounded, too.
        return max(greatest_s - offset_s, offset_s - least_s) + _margin(self._newest_peer_s, now_s)

    @property
    def offset_s(self) -> float | None:
        """`offset_at` the newest arrival."""
        return self.offset_at(self._newest_s)

    @property
    def bound_s(self) -> float | None:
        """`bound_at` the newest arrival."""
        return self.bound_at(self._newest_s)

    @property
    def estimator(self) -> Estimator | None:
        """What the offset comes from; None while it is unknown."""
        if self._shared_clock:
            return "shared clock"
        if self.offset_s is None:
            return None
        return "mean" if self._symmetric(*self._interval.at(self._newest_s)) else "interval"

    @property
    def settled(self) -> bool:
        """True once the offset rests on a second of messages."""
        return self._shared_clock or (self._to_peer.count > 0 and self._newest_s - self._first_s >= _SETTLED_S)

    def one_way_from_peer_s(self, peer_sent_s: float, local_received_s: float) -> float | None:
        """The delay of a message from the peer, in seconds; None while the offset is unknown.

        It is as uncertain as the offset, and never below 0 for stamps that were taken in.
        """
        offset_s = self.offset_at(local_received_s)
        return None if offset_s is None else local_received_s - peer_sent_s + offset_s


def _margin(peer_s: float, local_s: float) -> float:
    return _ROUNDING * (abs(peer_s) + abs(local_s))
