"""Rotation of messages over several TCP connections, so that newer messages overtake those behind a lost packet.

TCP delivers in order, so that a lost packet blocks a connection for a round trip. With eight connections that delays
only every eighth message, and newer ones overtake it. Eight bridge a burst of losses of 50 ms; four barely do.
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
"""Maximum number of control connections of one peer."""
SILENCE_S: Final = 0.5
"""Time in seconds for which a connection may be silent while others of its peer are not; then it is passed over."""
_REST_S: Final = 1e-3
"""Time, per connection of the peer, for which a full connection is not tried, in seconds. So the cost of trying full
connections does not grow with their number."""
_GROUPED: Final = 0x01
"""First byte of a routing id with a group. ZeroMQ's ids begin with 0x00."""
_GROUP_BYTES: Final = 16


def new_group() -> bytes:
    """Return a new group, the common prefix of one peer's routing ids: 0x01 and 15 random bytes."""
    return bytes([_GROUPED]) + secrets.token_bytes(_GROUP_BYTES - 1)


def routing_id(group: bytes, index: int) -> bytes:
    """Return the ZeroMQ routing id of the connection `index` of a group."""
    return group + bytes([index])


def group_of(name: bytes) -> bytes:
    """Return the group of the routing id `name`; an id that `routing_id` did not make is a group by itself."""
    is_grouped = len(name) == _GROUP_BYTES + 1 and name[0] == _GROUPED and name[-1] < MOST_CONNECTIONS_EACH
    return name[:-1] if is_grouped else name


class Offered(Enum):
    """Whether a connection took an offered message."""

    TAKEN = auto()
    FULL = auto()
    """The connection does not keep up, or is not connected."""
    GONE = auto()


@dataclass(eq=False, kw_only=True)
class RoundRobinConnection:
    """State of one of a peer's connections, as `RoundRobin` needs it."""

    heard_s: float = 0.0
    """Time of the newest message from the connection."""
    full_until_s: float = 0.0
    """Time before which the connection is not tried, because it was full."""
    tried_s: float = 0.0
    """Time at which a message was last offered to the connection, not counting those sent over all connections."""


AnyConnection = TypeVar("AnyConnection", bound=RoundRobinConnection)


class RoundRobin(Generic[AnyConnection]):
    """Connections of a peer, over which messages go in rotation."""

    def __init__(self, offer: Callable[[AnyConnection, bytes], Offered]) -> None:
        """`offer` sends a payload over a connection without waiting, and calls `forget` for one that is gone."""
        self.connections: deque[AnyConnection] = deque()
        self._heard_s = 0.0
        self._offer = offer

    def heard(self, connection: AnyConnection, now_s: float) -> None:
        """Note a message from `connection`."""
        connection.heard_s = self._heard_s = now_s

    def forget(self, connection: AnyConnection) -> None:
        """Remove a connection that is gone; from now on silence is measured against the remaining connections."""
        self.connections.remove(connection)
        self._heard_s = max((each.heard_s for each in self.connections), default=0.0)

    def send(self, payload: bytes, now_s: float, *, everywhere: bool) -> bool:
        """Send over the next connection that takes the payload; if `everywhere`, over all. Return whether it was taken.

        Unless `everywhere`, connections are passed over that were just found full, or are silent while others are not.
        Twice a second a silent connection gets a copy: it may work again, and the peer, too, waits for a message from
        it.
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
