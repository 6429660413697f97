"""Budget of bytes of each connection of a port, by the kernel's count of received bytes; does no I/O.

ZeroMQ reads a message whole before anybody sees it, and a message of endless parts never is: only the kernel's count
shows it in time.
"""

from collections.abc import Mapping
from typing import Final

CONTROL_BYTES_PER_S: Final = 2e5
VIEW_BYTES_PER_S: Final = 64e3
"""Budgets of a connection to the control port and to the view port, in bytes a second: an operator sends 45 kB/s over
all its connections, a viewer's subscriptions are some bytes."""
TOGETHER: Final = 4
"""Budget of all connections of a port together, as a multiple of one's: parts of a message cost ZeroMQ 25 times their
bytes"""
BURST_S: Final = 4.0
"""Time whose budget may come at once, in seconds: a link that was blocked delivers what has waited"""


class Traffic:
    """Buckets of the connections of one port, which leak at the budget's rate."""

    def __init__(self, bytes_per_s: float) -> None:
        """bytes_per_s: budget of each connection; `BURST_S` times as many bytes may come at once."""
        self.bytes_per_s = bytes_per_s
        self._counted: dict[int, int] = {}
        self._levels: dict[int, float] = {}
        self._now_s: float | None = None

    def over(self, received: Mapping[int, int], now_s: float) -> tuple[list[int], dict[int, int]]:
        """Return the connections beyond their budget, the heaviest first, and the bytes of each since the last call.

        received: bytes that each connection has received since it began, keyed by a number that no other ever has.
        """
        leaked = 0.0 if self._now_s is None else self.bytes_per_s * (now_s - self._now_s)
        self._now_s = now_s
        new = {number: count - self._counted.get(number, 0) for number, count in received.items()}
        self._counted = dict(received)
        self._levels = {
            number: max(self._levels.get(number, 0.0) - leaked, 0.0) + count for number, count in new.items()
        }
        most, together, over = BURST_S * self.bytes_per_s, sum(self._levels.values()), []
        for number, level in sorted(self._levels.items(), key=lambda item: -item[1]):
            if level <= most and together <= TOGETHER * most:
                break
            over.append(number)
            together -= level
        return over, new
