"""Guaranteed bounds of a clock offset, which follow because no message arrives before it was sent."""

import math


class OffsetInterval:
    """Guaranteed bounds of a clock offset that drifts by at most `max_skew` seconds a second.

    The offset is at most the peer's time of reception minus our stamp, and at least the peer's stamp minus our time of
    reception. So each direction of the link gives one bound. An old bound is loosened by the largest possible drift
    since; so only the tightest bound of each kind is kept. Times are seconds of our clock.
    """

    def __init__(self, max_skew: float) -> None:
        self._max_skew = max_skew
        self._at_s = -math.inf
        self._least_s = -math.inf
        self._greatest_s = math.inf

    def advance(self, now_s: float) -> None:
        """Loosen both bounds by the possible drift up to `now_s`."""
        if self._at_s < now_s:
            self._least_s, self._greatest_s = self.at(now_s)
            self._at_s = now_s

    def at(self, now_s: float) -> tuple[float, float]:
        """Return the least and the greatest possible offset at `now_s`, in seconds; infinite while unknown."""
        if self._at_s == -math.inf:
            return self._least_s, self._greatest_s
        loosened_s = self._max_skew * abs(now_s - self._at_s)
        return self._least_s - loosened_s, self._greatest_s + loosened_s

    @property
    def bounded(self) -> bool:
        """Whether both bounds are known."""
        return self._greatest_s - self._least_s < math.inf

    def bound_below(self, offset_s: float, margin_s: float) -> bool:
        """Bound the present offset below by `offset_s` − `margin_s`.

        Return False, and change nothing, if that contradicts the upper bound.
        """
        if offset_s - margin_s > self._greatest_s:
            return False
        self._least_s = max(self._least_s, offset_s - margin_s)
        return True

    def bound_above(self, offset_s: float, since_s: float, margin_s: float) -> bool:
        """Bound above by `offset_s` + `margin_s` the offset at some unknown time between `since_s` and now.

        Return False, and change nothing, if that contradicts the lower bound.
        """
        greatest_s = offset_s + margin_s + self._max_skew * (self._at_s - since_s)
        if greatest_s < self._least_s:
            return False
        self._greatest_s = min(self._greatest_s, greatest_s)
        return True
