"""Limit on the payloads that one tick decodes: all from the operator, a few from other peers."""

from collections.abc import Iterable, Iterator

OTHERS_PER_TICK = 8
"""Maximum number of payloads a tick from all peers but the operator: four times the traffic of eight observers at 250
Hz. Decoding them takes 80 us."""
EACH_OTHER_PER_TICK = 2
"""Maximum number of payloads a tick from each peer but the operator, so that a flood from one leaves room for
others."""


class Admission:
    """Counters of the payloads in one tick; payloads beyond the limits are dropped unread and counted, never queued."""

    def __init__(self) -> None:
        self.unread = 0
        """Number of payloads that were dropped unread; the operator's never are."""
        self._looked_at = 0
        self._by_peer: dict[bytes, int] = {}

    def begin_tick(self) -> None:
        """Reset the counters of the limits."""
        self._looked_at = 0
        self._by_peer.clear()

    def admitted(
        self, messages: Iterable[tuple[bytes, bytes]], operator: bytes | None
    ) -> Iterator[tuple[bytes, bytes]]:
        """Yield those of `messages` (peer, payload) that are within the limits, in order. `operator` has no limit."""
        for peer, payload in messages:
            if peer != operator:
                seen = self._by_peer.get(peer, 0)
                if seen >= EACH_OTHER_PER_TICK or self._looked_at >= OTHERS_PER_TICK:
                    self.unread += 1
                    continue
                self._by_peer[peer] = seen + 1
                self._looked_at += 1
            yield peer, payload
