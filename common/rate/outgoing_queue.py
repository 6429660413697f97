"""Queue in front of our messages, from our stamps that the peer echoes."""

import math
from collections import deque
from typing import Final, NamedTuple

from common.statistics import RunningStatistics

_DRIFT: Final = 600e-6
"""Rise of the base delay per time: two clocks drift apart no faster (common/timing/clock_offset.py)."""
_LONGEST_S: Final = 1000.0
"""Longest possible queue, in seconds: more means another clock."""
_MOST_ECHOES: Final = 256
"""Number of echoes that wait to be taken; the oldest are forgotten."""


class Echo(NamedTuple):
    """Message of ours that has arrived at the peer."""

    sent_s: float
    """Time of sending, on our clock."""
    arrived_s: float
    """Time of arrival, on the peer's clock."""
    queue_s: float
    """One-way delay above the base delay."""


class OutgoingQueue:
    """One-way delay from us to the peer above the base delay (LEDBAT, RFC 6817), with unknown clock offset.

    The base delay is a minimum that rises by 600 ppm: it follows any drift, and forgets an old route in minutes.
    """

    def __init__(self, seed: int = 0) -> None:
        self.delay = RunningStatistics(seed)
        """Queueing delays of all echoes, in seconds."""
        self._echoes: deque[Echo] = deque(maxlen=_MOST_ECHOES)
        self.reset()

    def reset(self) -> None:
        """Forget the base delay: the peer's clock has another origin, or the link was changed on purpose."""
        self._base_s = math.inf
        self._newest_s = -math.inf

    def echoed(self, sent_s: float, arrived_s: float) -> None:
        """Add the echo of our message of `sent_s`, received at `arrived_s` on the peer's clock; each counts once."""
        if sent_s <= self._newest_s:
            return
        delay_s = arrived_s - sent_s
        base_s = delay_s if math.isinf(self._base_s) else self._base_s + _DRIFT * (sent_s - self._newest_s)
        if not abs(delay_s - base_s) < _LONGEST_S:
            base_s = delay_s
        self._newest_s, self._base_s = sent_s, min(base_s, delay_s)
        self.delay.add(delay_s - self._base_s)
        self._echoes.append(Echo(sent_s, arrived_s, delay_s - self._base_s))

    def take(self) -> list[Echo]:
        """Return the echoes since the last call, oldest first."""
        taken = list(self._echoes)
        self._echoes.clear()
        return taken

    def summary_ms(self) -> dict[str, float | None]:
        """Return `p50` and `p95` of the queue in milliseconds; None before the first echo."""
        quantiles = {f"p{percent}": self.delay.quantile(percent / 100.0) for percent in (50, 95)}
        return {name: None if value_s is None else 1e3 * value_s for name, value_s in quantiles.items()}
