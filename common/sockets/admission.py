"""Limit of payloads that one tick decodes: all of the operator's, a few of the others'."""

from collections.abc import Iterable, Iterator

OTHERS_PER_TICK = 8
"""Payloads of all others together: four times the traffic of eight observers at 250 Hz, and 80 us to decode."""
EACH_OTHER_PER_TICK = 2
"""Payloads of each other peer, so that a flood leaves room for the rest."""


class Admission:
    """Counters of one tick; surplus payloads are dropped unread and counted, never queued."""

    def __init__(self) -> None:
        self.unread = 0
        """Number of payloads that were dropped unread; none are the operator's."""
        self._looked_at = 0
        self._by_peer: dict[bytes, int] = {}

    def begin_tick(self) -> None:
        """Reset the counters."""
        self._looked_at = 0
        self._by_peer.clear()

    def admitted(
        self, messages: Iterable[tuple[bytes, bytes]], operator: bytes | None
    ) -> Iterator[tuple[bytes, bytes]]:
        """Yield the `messages` (peer, payload) within the limits, in order; `operator` has no limit here."""
        for peer, payload in messages:
            if peer != operator:
                seen = self._by_peer.get(peer, 0)
                if seen >= EACH_OTHER_PER_TICK or self._looked_at >= OTHERS_PER_TICK:
                    self.unread += 1
                    continue
                self._by_peer[peer] = seen + 1
                self._looked_at += 1
            yield peer, payload
