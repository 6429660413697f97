"""Where the offset of two clocks must lie, because no message arrives before it was sent."""

import math


class OffsetInterval:
    """The certain bounds of an offset that drifts by at most `max_skew`.

    What leaves and what arrives each bound the offset from one side: it is at most what the peer's clock showed on
    reception less our stamp, and at least the peer's stamp less what our clock showed. An old bound is loosened by
    as much as the clocks may have drifted apart since, so that nothing has to be forgotten, and two numbers hold it
    all. Times are seconds of our clock.
    """

    def __init__(self, max_skew: float) -> None:
        self._max_skew = max_skew
        self._at_s = -math.inf
        self._least_s = -math.inf
        self._greatest_s = math.inf

    def advance(self, now_s: float) -> None:
        """Loosen both bounds up to `now_s`."""
        if self._at_s < now_s:
            self._least_s, self._greatest_s = self.at(now_s)
            self._at_s = now_s

    def at(self, now_s: float) -> tuple[float, float]:
        """The least and the greatest offset possible at `now_s`; infinite while unknown."""
        if self._at_s == -math.inf:
            return self._least_s, self._greatest_s
        loosened_s = self._max_skew * abs(now_s - self._at_s)
        return self._least_s - loosened_s, self._greatest_s + loosened_s

    def take_least(self, offset_s: float, margin_s: float) -> bool:
        """The offset is at least `offset_s` − `margin_s` now; False, and no effect, when that contradicts."""
        if offset_s - margin_s > self._greatest_s:
            return False
        self._least_s = max(self._least_s, offset_s - margin_s)
        return True

    def take_greatest(self, offset_s: float, since_s: float, margin_s: float) -> bool:
        """The offset was at most `offset_s` + `margin_s` at some time from `since_s` to now.

        False, and no effect, when that contradicts.
        """
        greatest_s = offset_s + margin_s + self._max_skew * (self._at_s - since_s)
        if greatest_s < self._least_s:
            return False
        self._greatest_s = min(self._greatest_s, greatest_s)
        return True
