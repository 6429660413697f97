"""How old what arrives is, without knowing the offset of two clocks: loop age (eq. 8) and queueing age."""

import math

from common.statistics import SlidingMinimum, SlidingQuantile


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

    def update(self, age_s: float, now_s: float) -> float:
        """Take in a loop age measured at `now_s`; the delay to reckon with from now on.

        ValueError when it is negative or not finite.
        """
        if not 0.0 <= age_s < math.inf:
            raise ValueError(f"age_s = {age_s}; valid: a finite time of 0 s or more")
        before_s = self.value(now_s)
        self._held_s = max(before_s, self._quantile.update(age_s))
        self._held_since_s = now_s
        return self._held_s

    def reset(self) -> None:
        """Forget every sample: the worst case holds until there is one again."""
        self._quantile.clear()
        self._held_s = self._worst_case_s

    @property
    def known(self) -> bool:
        """Whether a sample has been taken in since the start or the last reset."""
        return self._quantile.value is not None

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
