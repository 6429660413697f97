"""Peers of the robot side: connections of one key and one group are one peer."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from common.peer_name import peer_name
from common.sockets.turns import Offered, TurnConnection, Turns, group_of

_REMEMBERED_CONNECTIONS: Final = 1024


@dataclass(eq=False)
class Connection(TurnConnection):
    """State of one connection."""

    name: bytes
    """Routing id."""
    peer: "Peer"
    descriptor: int = -1
    """Descriptor by which the last message came; -1 if unknown."""
    number: int | None = None
    """Number of that connection at the port; 0 for an ended one, None while unknown."""
    hung_up: bool = False

    def stands_for(self, descriptor: int, number: int | None) -> None:
        """Note that messages come by another TCP connection than before."""
        self.descriptor, self.number, self.hung_up = descriptor, number, False


@dataclass(eq=False)
class Peer:
    """One or more connections of the same key and group."""

    name: bytes
    key: str
    """Authenticated key; empty without keys."""
    turns: Turns[Connection]


class Peers:
    """Peers and their newest connections; without I/O."""

    def __init__(self, offer: Callable[[Connection, bytes], Offered]) -> None:
        """`offer` as for Turns; a connection that is gone is forgotten."""
        self.connections: dict[bytes, Connection] = {}
        """Connections by routing id; beyond the limit the longest silent is forgotten."""
        self._offer = offer
        self._peers: dict[bytes, Peer] = {}
        self._received: Counter[bytes | str] = Counter()

    def get(self, name: bytes) -> Peer | None:
        """Return the peer of that name while it has a connection."""
        return self._peers.get(name)

    def connection(self, name: bytes, key: str) -> Connection:
        """Return the connection of a routing id and `key`, a new one if needed.

        A routing id that another key takes over leaves its peer: no two keys share a name.
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
        connection.peer.turns.connections.append(connection)
        return connection

    def count(self, peer: Peer) -> int:
        """Count a message; return this second's count of the key, or of the peer without keys."""
        account = peer.key or peer.name
        self._received[account] += 1
        return self._received[account]

    def begin_second(self) -> None:
        """Reset the counts."""
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
        if not connection.peer.turns.connections:
            del self._peers[connection.peer.name]


def peer_name_of(name: bytes, key: str) -> bytes:
    """Name the peer that a routing id belongs to."""
    return peer_name(key, group_of(name))
