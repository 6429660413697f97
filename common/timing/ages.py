"""Ages of received messages that need no clock offset: loop age (eq. 8) and queueing delay."""

import math

from common.statistics import SlidingMinimum, SlidingQuantile

_SETTLED = 5.0
"""Time constants after which what is left of a peak is negligible."""


class LoopAge:
    """t_d of eq. 8: age of the robot side's report when the operator's command in response arrives, in seconds.

    t_d is a quantile of the loop ages with peak hold: it rises at once and falls exponentially, so that it does not
    fluctuate when the arm stops. Without samples t_d is the worst case, from which it falls as from any peak. Call
    `update` in every tick, not only on arrivals, so that t_d grows on a silent link.
    """

    def __init__(
        self,
        worst_case_s: float,
        probability: float = 0.95,
        window_s: float = 0.5,
        time_constant_s: float = 0.5,
    ) -> None:
        for name, seconds in (("worst_case_s", worst_case_s), ("time_constant_s", time_constant_s)):
            if not (math.isfinite(seconds) and seconds > 0.0):
                raise ValueError(f"{name} = {seconds}; valid: a finite time above 0 s")
        self._worst_case_s = worst_case_s
        self._time_constant_s = time_constant_s
        self._quantile = SlidingQuantile(window_s, probability)
        self._held_s = worst_case_s
        self._held_since_s = 0.0
        self._known_since_s = math.inf

    def update(self, age_s: float, now_s: float) -> float:
        """Add a loop age measured at `now_s`; return t_d.

        Raises ValueError if the age is negative or not finite.
        """
        if not 0.0 <= age_s < math.inf:
            raise ValueError(f"age_s = {age_s}; valid: a finite time of 0 s or more")
        before_s = self.value(now_s)
        if not self.known:
            self._known_since_s = now_s
        self._held_s = max(before_s, self._quantile.update(age_s, now_s))
        self._held_since_s = now_s
        return self._held_s

    def reset(self) -> None:
        """Forget all samples: t_d is the worst case until the next sample."""
        self._quantile.clear()
        self._held_s = self._worst_case_s
        self._known_since_s = math.inf

    @property
    def known(self) -> bool:
        """Whether there is a sample since the start or the last reset."""
        return self._quantile.value is not None

    def settled(self, now_s: float) -> bool:
        """Return whether the worst case, assumed before the first sample, has died away to below a hundredth."""
        return now_s - self._known_since_s > _SETTLED * self._time_constant_s

    def value(self, now_s: float) -> float:
        """Return t_d at `now_s`, in seconds; the worst case without samples."""
        quantile_s = self._quantile.value
        if quantile_s is None:
            return self._worst_case_s
        elapsed_s = max(0.0, now_s - self._held_since_s)
        excess_s = self._held_s - quantile_s
        return quantile_s + excess_s * math.exp(-elapsed_s / self._time_constant_s)


class QueueingAge:
    """Queueing delay of a message: its one-way delay above the sliding minimum.

    A constant clock offset cancels, and so does a constant delay. The minimum's window of 10 s counts only time in
    which messages arrive, at a resolution of 0.1 s. Otherwise the minimum would expire in a long pause,
    and the delayed messages after the pause would count as fresh.
    """

    _RESOLUTION = 100
    _STEP_S = 0.1

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the minimum; for use after a jump of the peer's clock or a change of the link."""
        self._least_delay_s = SlidingMinimum(self._RESOLUTION)
        self._flowing_s = 0.0
        self._last_received_s: float | None = None

    def update(self, sent_s: float, received_s: float) -> float:
        """Add a message and return its queueing delay in seconds, >= 0. `sent_s`: peer's clock; `received_s`: ours.

        Raises ValueError if the stamps are not finite.
        """
        one_way_s = received_s - sent_s
        if not math.isfinite(one_way_s):
            raise ValueError(f"sent_s = {sent_s}, received_s = {received_s}; valid: finite seconds")
        if self._last_received_s is not None:
            gap_s = received_s - self._last_received_s
            self._flowing_s += min(max(gap_s, 0.0), self._STEP_S)
        self._last_received_s = received_s
        return one_way_s - self._least_delay_s.update(int(self._flowing_s / self._STEP_S), one_way_s)
