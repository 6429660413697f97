"""A driver's clock and ours: certain bounds in place of an estimate, each used on its safe side."""

from typing import Final

from common.timing.offset_interval import OffsetInterval

_MAX_SKEW: Final = 600e-6
_ROUNDING: Final = 1e-15


class DriverClock:
    """What the driver's clock may be ahead of ours, from stamps that no message can contradict.

    What arrives was sent before, and what it echoes was sent before it was read. So a state is never taken to be
    younger than it can be, and a time at which the arm must stop is never told later than it is.
    """

    def __init__(self) -> None:
        self._interval = OffsetInterval(_MAX_SKEW)
        self._at_s = 0.0

    def take(self, sent_s: float, received_s: float, echoed: tuple[float, float] | None) -> bool:
        """Take in a message; False for stamps that contradict all before: a clock has jumped, or they are invented.

        echoed: our stamp, and how long the driver had held that.
        """
        self._at_s, margin_s = max(self._at_s, received_s), _ROUNDING * (abs(sent_s) + abs(received_s))
        self._interval.advance(received_s)
        possible = self._interval.take_least(sent_s - received_s, margin_s)
        if echoed is not None and possible:
            echo_s, held_s = echoed
            possible = self._interval.take_greatest(sent_s - held_s - echo_s, echo_s, margin_s)
        return possible

    @property
    def known(self) -> bool:
        """Whether both bounds are."""
        least_s, greatest_s = self._interval.at(self._at_s)
        return greatest_s - least_s < float("inf")

    def ours_s(self, driver_s: float) -> float:
        """When that was by our clock, at the earliest; minus infinity while nothing was echoed."""
        return driver_s - self._interval.at(self._at_s)[1]

    def drivers_s(self, our_s: float) -> float:
        """What the driver's clock shows then, at the earliest."""
        return our_s + self._interval.at(self._at_s)[0]
