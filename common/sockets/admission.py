"""How many payloads are worth a look in one tick: all of the operator's, a few of anybody else's."""

from collections.abc import Iterable, Iterator

OTHERS_PER_TICK = 8
"""Payloads of all others together: enough for eight observers at 250 Hz four times over, and 80 us to decode."""
EACH_OTHER_PER_TICK = 2
"""Payloads of any one of them, so that one who floods leaves room for the rest."""


class Admission:
    """Counts within a tick; what is too much is dropped unread and counted, never queued."""

    def __init__(self) -> None:
        self.unread = 0
        """Payloads of others than the operator that were dropped unread."""
        self._looked_at = 0
        self._by_peer: dict[bytes, int] = {}

    def begin_tick(self) -> None:
        """The counts begin anew."""
        self._looked_at = 0
        self._by_peer.clear()

    def admitted(
        self, messages: Iterable[tuple[bytes, bytes]], operator: bytes | None
    ) -> Iterator[tuple[bytes, bytes]]:
        """Those of `messages` (peer, payload) that are worth a look, in their order; `operator` has no limit here."""
        for peer, payload in messages:
            if peer != operator:
                seen = self._by_peer.get(peer, 0)
                if seen >= EACH_OTHER_PER_TICK or self._looked_at >= OTHERS_PER_TICK:
                    self.unread += 1
                    continue
                self._by_peer[peer] = seen + 1
                self._looked_at += 1
            yield peer, payload
