"""Queueing delay of our messages in the link, measured by our stamps that the peer echoes."""

import math
from collections import deque
from typing import Final, NamedTuple

from common.statistics import RunningStatistics

_DRIFT: Final = 600e-6
"""Rise of the base delay, in seconds a second: the largest drift of two clocks (common/timing/clock_offset.py)."""
_LONGEST_S: Final = 1000.0
"""Longest possible queueing delay, in seconds: a larger value means that the peer's clock jumped."""
_MOST_ECHOES: Final = 256
"""Maximum number of echoes that wait to be taken; beyond it the oldest are forgotten."""


class Echo(NamedTuple):
    """Echo that shows that a message of ours has arrived at the peer."""

    sent_s: float
    """Time at which our message was sent, on our clock."""
    arrived_s: float
    """Time at which our message arrived, on the peer's clock."""
    queue_s: float
    """Queueing delay of our message: its one-way delay above the base delay."""


class OutgoingQueue:
    """Queueing delay from us to the peer: one-way delay above a base delay (LEDBAT, RFC 6817). Needs no clock offset.

    The base delay is a minimum that rises by 600 ppm. So it follows any drift of the clocks, and the delay of an old
    route is forgotten in minutes.
    """

    def __init__(self, seed: int = 0) -> None:
        self.delay = RunningStatistics(seed)
        """Statistics of the queueing delays of all echoed messages, in seconds."""
        self._echoes: deque[Echo] = deque(maxlen=_MOST_ECHOES)
        self.reset()

    def reset(self) -> None:
        """Forget the base delay, because the peer's clock has another origin or the link was changed on purpose."""
        self._base_s = math.inf
        self._newest_s = -math.inf

    def echoed(self, sent_s: float, arrived_s: float) -> None:
        """Add the echo of our message of `sent_s`, which the peer received at `arrived_s`; ignore repeated echoes."""
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
        """Return the echoes that were added since the last call, oldest first."""
        taken = list(self._echoes)
        self._echoes.clear()
        return taken

    def summary_ms(self) -> dict[str, float | None]:
        """Return `p50` and `p95` of the queueing delay in milliseconds; None before the first echo."""
        quantiles = {f"p{percent}": self.delay.quantile(percent / 100.0) for percent in (50, 95)}
        return {name: None if value_s is None else 1e3 * value_s for name, value_s in quantiles.items()}
