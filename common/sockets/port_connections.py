"""Bound on the connections of one port. Introduced connections stay; of the others (newcomers) the oldest are ended."""

from collections.abc import Iterator
from typing import Final

KEY_CONNECTIONS: Final = 64
"""Maximum number of connections of one key to a port: eight operator sides of eight connections"""
SILENT_LIMIT_S: Final = 10.0
"""Time after which a connection that has said nothing is ended, in seconds"""


class PortConnections:
    """Connections of one port, keyed by descriptor; does no I/O."""

    def __init__(self, limit: int, introduced_s: float) -> None:
        """Allow `limit` connections at once. One that has said nothing for `introduced_s` is ended."""
        self.hung_up = 0
        """Number of connections that were ended because of the limit."""
        self.limit = limit
        self._introduced_s = introduced_s
        self._newcomers: dict[int, float] = {}
        """Time at which each newcomer was accepted, keyed by descriptor, oldest first."""
        self._known: set[int] = set()
        self._numbers: dict[int, int] = {}
        self._accepted = 0

    def accepted(self, descriptor: int, now_s: float) -> None:
        """Add a connection that was just accepted, as a newcomer."""
        self.ended(descriptor)
        self._newcomers[descriptor] = now_s
        self._accepted += 1
        self._numbers[descriptor] = self._accepted

    def introduced(self, descriptor: int) -> None:
        """Count the connection as introduced, because it carried a message after a successful handshake."""
        if self._newcomers.pop(descriptor, None) is not None:
            self._known.add(descriptor)

    def is_new(self, descriptor: int) -> bool:
        """Return whether the connection has not been introduced."""
        return descriptor in self._newcomers

    def number(self, descriptor: int) -> int:
        """Return the number of the descriptor's connection, counted from 1 in order of arrival; 0 for none."""
        return self._numbers.get(descriptor, 0)

    def numbers(self) -> dict[int, int]:
        """Return the numbers of the present connections, keyed by descriptor."""
        return dict(self._numbers)

    def ended(self, descriptor: int) -> None:
        """Remove an ended connection; its descriptor may be used again."""
        self._newcomers.pop(descriptor, None)
        self._known.discard(descriptor)
        self._numbers.pop(descriptor, None)

    def surplus(self, now_s: float) -> Iterator[int]:
        """Yield the connections that the caller ends: newcomers that say nothing, and the oldest ones beyond the limit.

        So a quick handshake succeeds however many others connect.
        """
        while self._newcomers:
            descriptor, came_s = next(iter(self._newcomers.items()))
            if now_s - came_s >= self._introduced_s or len(self._newcomers) + len(self._known) > self.limit:
                self.ended(descriptor)
                self.hung_up += 1
                yield descriptor
            else:
                return
