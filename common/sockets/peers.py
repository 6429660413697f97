"""Peers of the robot side: connections of one key and one group are one peer."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from common.peer_name import peer_name
from common.sockets.turns import Offered, Turns, Way, group_of

_REMEMBERED_CONNECTIONS: Final = 1024


@dataclass(eq=False)
class Connection(Way):
    """The memory of one connection."""

    name: bytes
    """The routing id."""
    peer: "Peer"
    descriptor: int = -1
    """The descriptor that the last message came by; -1 where it is not known."""
    number: int | None = None
    """The number of that connection in the crowd; 0 for one that ended, None while unknown."""
    hung_up: bool = False

    def stands_for(self, descriptor: int, number: int | None) -> None:
        """Messages come by another TCP connection than before."""
        self.descriptor, self.number, self.hung_up = descriptor, number, False


@dataclass(eq=False)
class Peer:
    """One or more connections of the same key and group."""

    name: bytes
    key: str
    """Whom it authenticated as; empty without keys."""
    turns: Turns[Connection]


class Peers:
    """Peers and their connections, the newest of them; without I/O."""

    def __init__(self, offer: Callable[[Connection, bytes], Offered]) -> None:
        """`offer` as for Turns; a connection that is gone is forgotten."""
        self.connections: dict[bytes, Connection] = {}
        """By routing id; the one that was silent for longest gives way."""
        self._offer = offer
        self._peers: dict[bytes, Peer] = {}
        self._received: Counter[bytes | str] = Counter()

    def get(self, name: bytes) -> Peer | None:
        """The peer of that name, as long as it has a connection."""
        return self._peers.get(name)

    def connection(self, name: bytes, key: str) -> Connection:
        """The connection by its routing id, whose messages come with `key`: met before, or new.

        A routing id that another key takes over leaves its peer: no name is within reach of two keys.
        """
        known = self.connections.get(name)
        if known is not None and known.peer.key == key:
            return known
        connection = Connection(name, self._peer(peer_name_of(name, key), key))
        if known is not None:
            connection.stands_for(known.descriptor, known.number)
            self._forget(known)
        elif len(self.connections) >= _REMEMBERED_CONNECTIONS:
            self._forget(min(self.connections.values(), key=lambda each: each.heard_s))
        self._peers[connection.peer.name] = connection.peer
        self.connections[name] = connection
        connection.peer.turns.ways.append(connection)
        return connection

    def count(self, peer: Peer) -> int:
        """Count a message, and return the count of this second: of the key, or without keys of the peer."""
        account = peer.key or peer.name
        self._received[account] += 1
        return self._received[account]

    def begin_second(self) -> None:
        """Count from nothing again."""
        self._received.clear()

    def _peer(self, name: bytes, key: str) -> Peer:
        return self._peers.get(name) or Peer(name, key, Turns(self._offer_or_forget))

    def _offer_or_forget(self, connection: Connection, payload: bytes) -> Offered:
        offered = self._offer(connection, payload)
        if offered is Offered.GONE:
            self._forget(connection)
        return offered

    def _forget(self, connection: Connection) -> None:
        del self.connections[connection.name]
        connection.peer.turns.forget(connection)
        if not connection.peer.turns.ways:
            del self._peers[connection.peer.name]


def peer_name_of(name: bytes, key: str) -> bytes:
    """Name the peer that a routing id belongs to."""
    return peer_name(key, group_of(name))
