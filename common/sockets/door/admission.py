"""Limit on the payloads that are decoded: all from the operator, a few a second from other peers."""

import math
from collections.abc import Iterable, Iterator

OTHERS_PER_S = 8000.0
"""Limit of payloads a second from all peers but the operator: four times the traffic of eight observers at 250 Hz.
Decoding them takes a twelfth of a core."""
EACH_OTHER_PER_S = 2000.0
"""Limit of payloads a second from each peer but the operator, so that a flood from one leaves room for others."""
AT_ONCE_S = 0.005
"""Time, in seconds, whose payloads may come at once"""


class Admission:
    """Token buckets of payloads; payloads beyond the limits are dropped unread and counted, never queued."""

    def __init__(self) -> None:
        self.unread = 0
        """Number of payloads that were dropped unread; the operator's never are."""
        self._now_s = -math.inf
        self._level = 0.0
        self._levels: dict[bytes, float] = {}
        """Payloads in the buckets of all peers and of each, but the operator's; they leak at the limits' rates."""

    def admitted(
        self, messages: Iterable[tuple[bytes, bytes]], operator: bytes | None, now_s: float
    ) -> Iterator[tuple[bytes, bytes]]:
        """Yield those of `messages` (peer, payload) that are within the limits, in order. `operator` has no limit."""
        for peer, payload in messages:
            if peer != operator and not self._takes(peer, now_s):
                self.unread += 1
                continue
            yield peer, payload

    def _takes(self, peer: bytes, now_s: float) -> bool:
        if (passed_s := now_s - self._now_s) > 0.0:
            self._now_s = now_s
            self._level = max(0.0, self._level - OTHERS_PER_S * passed_s)
            leaked = EACH_OTHER_PER_S * passed_s
            self._levels = {each: level - leaked for each, level in self._levels.items() if level > leaked}
        level = self._levels.get(peer, 0.0)
        if level >= AT_ONCE_S * EACH_OTHER_PER_S or self._level >= AT_ONCE_S * OTHERS_PER_S:
            return False
        self._level += 1.0
        self._levels[peer] = level + 1.0
        return True
