"""Peers of the robot side; connections that have the same key and the same group (round_robin.py) are one peer."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from common.peer_name import peer_name
from common.sockets.round_robin import Offered, RoundRobin, RoundRobinConnection, group_of

_REMEMBERED_CONNECTIONS: Final = 1024


@dataclass(eq=False)
class Connection(RoundRobinConnection):
    """State of one connection, identified by its ZeroMQ routing id."""

    name: bytes
    """Routing id."""
    peer: "Peer"
    descriptor: int = -1
    """Descriptor of the TCP connection by which the last message came; -1 if unknown."""
    number: int | None = None
    """Number of that TCP connection (PortConnections.number); 0 if it has ended, None while unknown."""
    hung_up: bool = False

    def stands_for(self, descriptor: int, number: int | None) -> None:
        """Note that messages of this routing id now come by the TCP connection `descriptor`, `number`."""
        self.descriptor, self.number, self.hung_up = descriptor, number, False


@dataclass(eq=False)
class Peer:
    """Peer with one or more connections of the same key and group."""

    name: bytes
    key: str
    """Authenticated public key; empty if the robot side uses no keys."""
    round_robin: RoundRobin[Connection]


class Peers:
    """Peers and their connections; does no I/O."""

    def __init__(
        self, offer: Callable[[Connection, bytes], Offered], observes: Callable[[str], bool] = lambda _: False
    ) -> None:
        """`offer` sends a payload over a connection without waiting; after GONE the connection is forgotten.

        `observes` tells whether a key may only observe.
        """
        self.connections: dict[bytes, Connection] = {}
        """Connections, keyed by routing id; beyond the limit the one that has been silent longest is forgotten."""
        self._offer, self._observes = offer, observes
        self._peers: dict[bytes, Peer] = {}
        self._received: Counter[bytes | str] = Counter()

    def get(self, name: bytes) -> Peer | None:
        """Return the peer of that name; None if it has no connection."""
        return self._peers.get(name)

    def connection(self, name: bytes, key: str) -> Connection:
        """Return the connection of the routing id `name` and `key`; make it if there is none.

        If the routing id belonged to another key, that key's connection is forgotten: no two keys share a routing id.
        """
        known, whose = self.connections.get(name), peer_name(key, group_of(name), observes=self._observes(key))
        if known is not None and known.peer.name == whose:
            return known
        connection = Connection(name, self._peer(whose, key))
        if known is not None:
            connection.stands_for(known.descriptor, known.number)
            self._forget(known)
        elif len(self.connections) >= _REMEMBERED_CONNECTIONS:
            self._forget(min(self.connections.values(), key=lambda each: each.heard_s))
        self._peers[connection.peer.name] = connection.peer
        self.connections[name] = connection
        connection.peer.round_robin.connections.append(connection)
        return connection

    def key_at(self, descriptor: int) -> str:
        """Return the key of the peer whose messages come by the TCP connection `descriptor`; empty if unknown."""
        return next((each.peer.key for each in self.connections.values() if each.descriptor == descriptor), "")

    def of_key(self, key: str) -> int:
        """Return the number of connections of a key."""
        return sum(each.peer.key == key for each in self.connections.values())

    def forget(self, connection: Connection) -> None:
        """Forget a connection that was ended."""
        if self.connections.get(connection.name) is connection:
            self._forget(connection)

    def count(self, peer: Peer) -> int:
        """Count a message of `peer`; return how many its key has sent this second, or without keys the peer."""
        account = peer.key or peer.name
        self._received[account] += 1
        return self._received[account]

    def begin_second(self) -> None:
        """Reset the counts of messages."""
        self._received.clear()

    def _peer(self, name: bytes, key: str) -> Peer:
        return self._peers.get(name) or Peer(name, key, RoundRobin(self._offer_or_forget))

    def _offer_or_forget(self, connection: Connection, payload: bytes) -> Offered:
        offered = self._offer(connection, payload)
        if offered is Offered.GONE:
            self._forget(connection)
        return offered

    def _forget(self, connection: Connection) -> None:
        del self.connections[connection.name]
        connection.peer.round_robin.forget(connection)
        if not connection.peer.round_robin.connections:
            del self._peers[connection.peer.name]
