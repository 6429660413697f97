"""Bound the connections of one port: those that were introduced stay, and of the others the newest."""

from collections.abc import Iterator


class Crowd:
    """The connections of one port by their descriptors; without I/O."""

    def __init__(self, limit: int, introduced_s: float) -> None:
        """At most `limit` at once; one that is `introduced_s` old has been introduced, or else would be gone."""
        self.hung_up = 0
        """Connections that were one too many."""
        self.limit = limit
        self._introduced_s = introduced_s
        self._newcomers: dict[int, float] = {}
        """When each came, the oldest first."""
        self._known: set[int] = set()
        self._numbers: dict[int, int] = {}
        self._accepted = 0

    def came(self, descriptor: int, now_s: float) -> None:
        """A connection was accepted."""
        self.went(descriptor)
        self._newcomers[descriptor] = now_s
        self._accepted += 1
        self._numbers[descriptor] = self._accepted

    def spoke(self, descriptor: int) -> None:
        """A message came by it that only who has been introduced can send."""
        if self._newcomers.pop(descriptor, None) is not None:
            self._known.add(descriptor)

    def number(self, descriptor: int) -> int:
        """Which connection the descriptor stands for, counted from 1 in the order of coming; 0 for none."""
        return self._numbers.get(descriptor, 0)

    def went(self, descriptor: int) -> None:
        """The connection ended; the descriptor may stand for another one next."""
        self._newcomers.pop(descriptor, None)
        self._known.discard(descriptor)
        self._numbers.pop(descriptor, None)

    def surplus(self, now_s: float) -> Iterator[int]:
        """The connections to end: the oldest newcomers, so that a quick one gets in in any crowd."""
        while self._newcomers:
            descriptor, came_s = next(iter(self._newcomers.items()))
            if now_s - came_s >= self._introduced_s:
                self.spoke(descriptor)
            elif len(self._newcomers) + len(self._known) > self.limit:
                self.went(descriptor)
                self.hung_up += 1
                yield descriptor
            else:
                return
