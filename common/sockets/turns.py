"""Rotation of messages over several connections: newer ones overtake those behind a lost packet.

TCP delivers in order, so that a lost packet blocks a connection for a round trip. Over eight connections that is
every eighth message, which newer ones overtake. Eight outlast a burst of losses of 50 ms; four barely do.
"""

import secrets
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, Generic, TypeVar

CONNECTIONS: Final = 8
"""Default number of control connections of an operator side."""
MOST_CONNECTIONS_EACH: Final = 16
"""Largest number of connections of one peer."""
SILENCE_S: Final = 0.5
"""Silence beyond its peer's, in seconds, after which a connection is passed over."""
_REST_S: Final = 1e-3
"""Rest of a full connection, in seconds times the number of connections: trying all of them costs as much as one."""
_GROUPED: Final = 0x01
"""First byte of a routing id with a group. ZeroMQ's ids begin with 0x00."""
_GROUP_BYTES: Final = 16


def new_group() -> bytes:
    """Return a unique group: 0x01 and 15 random bytes."""
    return bytes([_GROUPED]) + secrets.token_bytes(_GROUP_BYTES - 1)


def routing_id(group: bytes, index: int) -> bytes:
    """Return the routing id of a group's connection."""
    return group + bytes([index])


def group_of(name: bytes) -> bytes:
    """Return the group of a routing id; an id that `routing_id` did not make is a separate group."""
    is_grouped = len(name) == _GROUP_BYTES + 1 and name[0] == _GROUPED and name[-1] < MOST_CONNECTIONS_EACH
    return name[:-1] if is_grouped else name


class Offered(Enum):
    """Answer of a connection to an offered message."""

    TAKEN = auto()
    FULL = auto()
    """The connection does not keep up, or is not connected."""
    GONE = auto()


@dataclass(eq=False, kw_only=True)
class TurnConnection:
    """Connection of a peer."""

    heard_s: float = 0.0
    """Time of the newest message from it."""
    full_until_s: float = 0.0
    """Time before which the connection is not tried."""
    tried_s: float = 0.0
    """Time of the last message offered to it; those sent everywhere do not count."""


AnyConnection = TypeVar("AnyConnection", bound=TurnConnection)


class Turns(Generic[AnyConnection]):
    """Connections of a peer, the next in turn first."""

    def __init__(self, offer: Callable[[AnyConnection, bytes], Offered]) -> None:
        """`offer` sends without waiting, and forgets connections that are gone."""
        self.connections: deque[AnyConnection] = deque()
        self._heard_s = 0.0
        self._offer = offer

    def heard(self, connection: AnyConnection, now_s: float) -> None:
        """Note a message from `connection`."""
        connection.heard_s = self._heard_s = now_s

    def forget(self, connection: AnyConnection) -> None:
        """Remove a lost connection; silence is measured against the remaining ones."""
        self.connections.remove(connection)
        self._heard_s = max((each.heard_s for each in self.connections), default=0.0)

    def send(self, payload: bytes, now_s: float, *, everywhere: bool) -> bool:
        """Send over the next connection that takes the payload, or over each; return whether any did.

        Unless `everywhere`, passes over a connection that was full a moment ago, or silent while others were not.
        Twice a second a silent one gets a copy: it may be back, and the peer waits to hear from it, too.
        """
        taken = False
        for _ in range(len(self.connections)):
            connection = self.connections[0]
            self.connections.rotate(-1)
            is_silent = connection.heard_s < self._heard_s - SILENCE_S
            if not everywhere:
                if now_s < connection.full_until_s or (is_silent and now_s < connection.tried_s + SILENCE_S):
                    continue
                connection.tried_s = now_s
            offered = self._offer(connection, payload)
            if offered is Offered.TAKEN:
                taken |= everywhere or not is_silent
                if not everywhere and taken:
                    break
            elif offered is Offered.FULL:
                connection.full_until_s = now_s + _REST_S * len(self.connections)
        return taken
