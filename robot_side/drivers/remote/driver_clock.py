"""Bounds of a driver's clock against ours, from the stamps of its messages."""

from common.timing.clock_offset import MAX_SKEW, ROUNDING
from common.timing.offset_interval import OffsetInterval


class DriverClock:
    """Bounds of the driver's clock minus ours, computed from stamps.

    A message is sent before it arrives, and read before its echo is sent. With these bounds a state never counts as
    younger than it can be, and a time to stop is never too late.
    """

    def __init__(self) -> None:
        self._interval = OffsetInterval(MAX_SKEW)
        self._at_s = 0.0

    def update(self, sent_s: float, received_s: float, echoed: tuple[float, float] | None) -> bool:
        """Take a message's stamps; False if they contradict earlier stamps, because a clock jumped or a stamp is false.

        echoed: our stamp that the message echoes, and the time for which the driver held it.
        """
        self._at_s, margin_s = max(self._at_s, received_s), ROUNDING * (abs(sent_s) + abs(received_s))
        self._interval.advance(received_s)
        possible = self._interval.bound_below(sent_s - received_s, margin_s)
        if echoed is not None and possible:
            echo_s, held_s = echoed
            possible = self._interval.bound_above(sent_s - held_s - echo_s, echo_s, margin_s)
        return possible

    @property
    def known(self) -> bool:
        """Whether both bounds of the clock's offset are known"""
        return self._interval.bounded

    def ours_s(self, driver_s: float) -> float:
        """Return the earliest possible time of `driver_s` on our clock; minus infinity before the first echo."""
        return driver_s - self._interval.at(self._at_s)[1]

    def drivers_s(self, our_s: float) -> float:
        """Return the earliest possible time of `our_s` on the driver's clock."""
        return our_s + self._interval.at(self._at_s)[0]
