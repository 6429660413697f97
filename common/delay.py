"""Delay estimation from stamps alone: loop age (eq. 8), queueing age, and the offset between two clocks."""

import math
from collections import deque

from common.statistics import SlidingQuantile


class LoopAge:
    """t_d of eq. 8: how old the world is by the time a reaction to it arrives, in seconds.

    A quantile of the loop age, held so that it rises at once and falls exponentially: stopping does not make
    it chatter. As long as no sample is known it is the worst case, and from there it falls like from any
    peak. Update it in every tick, not only on arrivals: then a link that falls silent ages, too.
    """

    def __init__(
        self,
        worst_case_s: float,
        probability: float = 0.95,
        window: int = 500,
        time_constant_s: float = 0.5,
    ) -> None:
        for name, seconds in (("worst_case_s", worst_case_s), ("time_constant_s", time_constant_s)):
            if not (math.isfinite(seconds) and seconds > 0.0):
                raise ValueError(f"{name} = {seconds}; valid: a finite time above 0 s")
        self._worst_case_s = worst_case_s
        self._time_constant_s = time_constant_s
        self._quantile = SlidingQuantile(window, probability)
        self._held_s = worst_case_s
        self._held_since_s = 0.0

    def update(self, age_s: float, now_s: float) -> None:
        """Take in a loop age measured at `now_s`; ValueError when it is negative or not finite."""
        if not (math.isfinite(age_s) and age_s >= 0.0):
            raise ValueError(f"age_s = {age_s}; valid: a finite time of 0 s or more")
        before_s = self.value(now_s)
        self._quantile.update(age_s)
        self._held_s = max(before_s, self._quantile.value or 0.0)
        self._held_since_s = now_s

    def reset(self) -> None:
        """Forget every sample: the worst case holds until there is one again."""
        self._quantile.clear()
        self._held_s = self._worst_case_s

    def value(self, now_s: float) -> float:
        """The delay to reckon with at `now_s`, in seconds; never 0 for want of samples."""
        quantile_s = self._quantile.value
        if quantile_s is None:
            return self._worst_case_s
        elapsed_s = max(0.0, now_s - self._held_since_s)
        excess_s = self._held_s - quantile_s
        return quantile_s + excess_s * math.exp(-elapsed_s / self._time_constant_s)


class QueueingAge:
    """How long a message waited beyond the link's own delay: its one-way delay above the sliding minimum.

    A constant clock offset cancels, and so does a steady delay, however long. The window counts the time in
    which messages flow, at a resolution of a hundredth: silence does not wear out the minimum, or the backlog
    after a long pause would pass for fresh.
    """

    _RESOLUTION = 100

    def __init__(self, window_s: float = 10.0) -> None:
        if not (math.isfinite(window_s) and window_s > 0.0):
            raise ValueError(f"window_s = {window_s}; valid: a finite time above 0 s")
        self._step_s = window_s / self._RESOLUTION
        self.reset()

    def reset(self) -> None:
        """Forget the peer's clock, because a new one counts from another origin."""
        self._least_delay_s = SlidingMinimum(self._RESOLUTION)
        self._flowing_s = 0.0
        self._last_received_s: float | None = None

    def update(self, sent_s: float, received_s: float) -> float:
        """The age of a message stamped `sent_s` by the peer's clock and `received_s` by ours; seconds, >= 0.

        ValueError when the stamps are not finite.
        """
        one_way_s = received_s - sent_s
        if not math.isfinite(one_way_s):
            raise ValueError(f"sent_s = {sent_s}, received_s = {received_s}; valid: finite seconds")
        if self._last_received_s is not None:
            gap_s = received_s - self._last_received_s
            self._flowing_s += min(max(gap_s, 0.0), self._step_s)
        self._last_received_s = received_s
        return one_way_s - self._least_delay_s.update(int(self._flowing_s / self._step_s), one_way_s)


class ClockOffset:
    """Offset of the peer's clock and round trip, from the four stamps that ordinary traffic carries.

    The offset is the mean over the newest `window` exchanges, which is best where jitter is alike both ways.
    Two processes that read the same clock (`shared_clock`) differ by exactly 0.
    """

    def __init__(self, *, shared_clock: bool, window: int = 1000) -> None:
        if window < 1:
            raise ValueError(f"window = {window}; valid: 1 exchange or more")
        self.round_trip_s: float | None = None
        """The newest exchange's time both ways without the peer's holding time; None before the first."""
        self.rejected = 0
        """Exchanges whose stamps contradict each other."""
        self._shared_clock = shared_clock
        self._exchanges = 0
        # Sums of differences from the first offset: clocks may lie days apart, and jitter is microseconds.
        self._first_offset_s = 0.0
        self._deviations_s: deque[float] = deque()
        self._sum_s = 0.0
        self._window = window
        self._best = SlidingMinimum(window)

    def update(self, local_sent_s: float, peer_sent_s: float, peer_held_s: float, local_received_s: float) -> bool:
        """Take in one exchange: our stamp, echoed by the peer in what it sent after holding it.

        `peer_sent_s` is by the peer's clock, `local_sent_s` and `local_received_s` are by ours. False, and
        counted in `rejected`, when the holding time is negative or longer than the whole exchange.
        """
        round_trip_s = local_received_s - local_sent_s - peer_held_s
        if not (math.isfinite(peer_sent_s) and peer_held_s >= 0.0 and 0.0 <= round_trip_s < math.inf):
            self.rejected += 1
            return False
        self.round_trip_s = round_trip_s
        offset_s = peer_sent_s - peer_held_s / 2.0 - (local_sent_s + local_received_s) / 2.0
        if self._exchanges == 0:
            self._first_offset_s = offset_s
        deviation_s = offset_s - self._first_offset_s
        if len(self._deviations_s) == self._window:
            self._sum_s -= self._deviations_s.popleft()
        self._deviations_s.append(deviation_s)
        self._sum_s += deviation_s
        self._best.update(self._exchanges, round_trip_s)
        self._exchanges += 1
        return True

    @property
    def offset_s(self) -> float | None:
        """The peer's clock minus ours, in seconds; None until known."""
        if self._shared_clock:
            return 0.0
        if not self._deviations_s:
            return None
        return self._first_offset_s + self._sum_s / len(self._deviations_s)

    @property
    def bound_s(self) -> float | None:
        """Half the window's least round trip: what an asymmetric floor can hide; None until known."""
        if self._shared_clock:
            return 0.0
        least_s = self._best.value
        return None if least_s is None else least_s / 2.0

    def one_way_from_peer_s(self, peer_sent_s: float, local_received_s: float) -> float | None:
        """The delay of a message from the peer, in seconds; None while the offset is unknown.

        As uncertain as the offset, hence possibly below 0.
        """
        offset_s = self.offset_s
        return None if offset_s is None else local_received_s - (peer_sent_s - offset_s)


class SlidingMinimum:
    """The least of the values at the newest `span` positions, in memory bounded by `span`.

    A monotonic queue: a value is forgotten as soon as a later one is not above it.
    """

    def __init__(self, span: int) -> None:
        self._span = span
        self._candidates: deque[tuple[int, float]] = deque()

    def update(self, position: int, value: float) -> float:
        """Take in `value` at `position`, which never decreases; the minimum of the positions up to it."""
        candidates = self._candidates
        while candidates and candidates[-1][1] >= value:
            candidates.pop()
        if not candidates or candidates[-1][0] != position:
            candidates.append((position, value))
        while candidates[0][0] <= position - self._span:
            candidates.popleft()
        return candidates[0][1]

    def __len__(self) -> int:
        return len(self._candidates)

    @property
    def value(self) -> float | None:
        """The present minimum; None before the first value."""
        return self._candidates[0][1] if self._candidates else None
