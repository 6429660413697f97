"""Messages over several connections in turn: what a lost packet holds up on one is overtaken on the others.

TCP delivers in order, so that a lost packet holds up a connection for a round trip. Over eight connections that is
every eighth message, and a newer one has overtaken it. Eight outlast a burst of losses of 50 ms; four do barely.
"""

import secrets
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, Generic, TypeVar

CONNECTIONS: Final = 8
"""Control connections of an operator side, unless it is told another number."""
MOST_CONNECTIONS_EACH: Final = 16
"""At most so many of one peer."""
SILENCE_S: Final = 0.5
"""Pass over a connection that has been silent this much longer than its peer."""
_REST_S: Final = 1e-3
"""Leave a full connection alone this long, times the number of connections: trying all of them costs what one did."""
_GROUPED: Final = 0x01
"""The first byte of a routing id that names a group. ZeroMQ's own begin with 0x00."""
_GROUP_BYTES: Final = 16


def new_group() -> bytes:
    """A group that nobody else has: 0x01 and 15 random bytes."""
    return bytes([_GROUPED]) + secrets.token_bytes(_GROUP_BYTES - 1)


def routing_id(group: bytes, index: int) -> bytes:
    """The routing id of one of a group's connections."""
    return group + bytes([index])


def group_of(name: bytes) -> bytes:
    """The group that a routing id belongs to; any that `routing_id` did not make is a group of its own."""
    is_grouped = len(name) == _GROUP_BYTES + 1 and name[0] == _GROUPED and name[-1] < MOST_CONNECTIONS_EACH
    return name[:-1] if is_grouped else name


class Offered(Enum):
    """The answer of a connection that a message was offered to."""

    TAKEN = auto()
    FULL = auto()
    """The connection does not keep up, or is not connected."""
    GONE = auto()


@dataclass(eq=False, kw_only=True)
class Way:
    """One of a peer's connections."""

    heard_s: float = 0.0
    """The newest message by it."""
    full_until_s: float = 0.0
    """The connection is not tried before then."""
    tried_s: float = 0.0
    """A message was offered to it last, everything that goes everywhere aside."""


AnyWay = TypeVar("AnyWay", bound=Way)


class Turns(Generic[AnyWay]):
    """A peer's connections, the next in turn first."""

    def __init__(self, offer: Callable[[AnyWay, bytes], Offered]) -> None:
        """`offer` sends without waiting, and forgets what is gone."""
        self.ways: deque[AnyWay] = deque()
        self._heard_s = 0.0
        self._offer = offer

    def heard(self, way: AnyWay, now_s: float) -> None:
        """A message came by `way`."""
        way.heard_s = self._heard_s = now_s

    def forget(self, way: AnyWay) -> None:
        """Take out what is gone; the others are held against those that are left."""
        self.ways.remove(way)
        self._heard_s = max((each.heard_s for each in self.ways), default=0.0)

    def send(self, payload: bytes, now_s: float, *, everywhere: bool) -> bool:
        """Send over the next connection that takes it, or over each; whether any did.

        Passed over unless `everywhere`: one that was full a moment ago, or has been silent for long while others were
        not. Twice a second such a silent one gets a copy: it may be back, and the peer waits to hear from it, too.
        """
        taken = False
        for _ in range(len(self.ways)):
            way = self.ways[0]
            self.ways.rotate(-1)
            is_silent = way.heard_s < self._heard_s - SILENCE_S
            if not everywhere:
                if now_s < way.full_until_s or (is_silent and now_s < way.tried_s + SILENCE_S):
                    continue
                way.tried_s = now_s
            offered = self._offer(way, payload)
            if offered is Offered.TAKEN:
                taken |= everywhere or not is_silent
                if not everywhere and taken:
                    break
            elif offered is Offered.FULL:
                way.full_until_s = now_s + _REST_S * len(self.ways)
        return taken
