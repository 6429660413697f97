"""Sockets of the robot side, which distinguish peers and cut off those that flood or whose key was revoked."""

import contextlib
from collections import Counter
from collections.abc import Collection
from typing import Final

import zmq

from common.sockets.authentication import Authenticator, RobotKeys
from common.sockets.descriptors import shut_down
from common.sockets.endpoints import parse_operators
from common.sockets.gate import Gate, Gates
from common.sockets.inbox import Inbox
from common.sockets.key_files import KeyRole
from common.sockets.peers import Connection, Peers
from common.sockets.port_connections import KEY_CONNECTIONS, SILENT_LIMIT_S
from common.sockets.readable import descriptor_of, readable, user_of
from common.sockets.round_robin import Offered
from common.sockets.shell import (
    CONTROL_LIMIT_BYTES,
    CONTROL_UNSENT_BYTES,
    VIEW_LIMIT_BYTES,
    VIEW_UNSENT_BYTES,
    SocketShell,
    bind_socket,
    check_size,
)
from common.sockets.tcp_figures import TcpFigures, peer_address, tcp_figures
from common.sockets.traffic import CONTROL_BYTES_PER_S, VIEW_BYTES_PER_S

PEER_LIMIT_PER_S = 5000
"""Maximum number of messages a second from one key, or without keys from one peer; above it that key or peer is cut
off. It is 20 times an operator's rate, and twice what arrives at once after ten seconds of a blocked link."""
_ROLES: Final[tuple[KeyRole, ...]] = ("operator", "observer")
HANDSHAKE_LIMIT_S = 5.0
"""Time limit of a handshake, in seconds: CURVE takes the server two round trips, of at most 2 s each in a session."""
_LONGEST_TOPIC = _MOST_SUBSCRIPTIONS = 64
"""Maximum length of a topic, and number of subscriptions over the life of a connection: each takes memory"""
_SUBSCRIPTIONS_PER_CALL = 256
MOST_CONNECTIONS = 1024
"""Maximum number of connections to each port, or a quarter of the descriptors that this process may open."""


class RobotSockets(SocketShell):
    """Sockets of the robot side, which are bound and distinguish peers. With `keys` they admit only allowed peers."""

    def __init__(
        self,
        bind: str,
        view_bind: str | None = None,
        *,
        insecure: bool = False,
        keys: RobotKeys | None = None,
        heartbeat_timeout_s: float = 3.0,
    ) -> None:
        """Bind the control socket to `bind` and the view socket to `view_bind`; None: the port after that of `bind`.

        A silent connection ends after `heartbeat_timeout_s`, which must exceed the link's real one-way delay. Raises
        ConfigurationError if an address is malformed, in use, or not this machine's. Also if it is open to the network
        with neither `keys` nor `insecure`.
        """
        control, view = parse_operators(bind, view_bind, guarded=insecure or keys is not None)
        self.flooding = 0
        """Number of messages above PEER_LIMIT_PER_S."""
        self._flooding: set[str] = set()
        self.revoked = 0
        """Number of messages from peers whose keys were revoked after their handshake."""
        self._keys = keys
        self.crowded = 0
        """Number of connections that were ended because of MOST_CONNECTIONS."""
        self._reported: list[str] = []
        self._peers = Peers(self._offer, self._observes)
        self._second = 0
        self._asked: Counter[tuple[int, int]] = Counter()
        """Subscriptions of each view connection, keyed by descriptor and number"""
        self._viewers: dict[int, tuple[int, str]] = {}
        """Number and key of each view connection that has subscribed, keyed by descriptor"""
        super().__init__(heartbeat_timeout_s, HANDSHAKE_LIMIT_S)
        try:
            self._control, self._view = self._open_control(zmq.ROUTER), self._open_view(zmq.XPUB)
            # So that only topics that there are take memory, and each viewer's key is known.
            self._view.setsockopt(zmq.XPUB_MANUAL, 1)
            self._inbox = Inbox(self._control, frames=2)
            control_gate = self._watch(self._control, CONTROL_UNSENT_BYTES, CONTROL_BYTES_PER_S)
            view_gate = self._watch(self._view, VIEW_UNSENT_BYTES, VIEW_BYTES_PER_S)
            self._ports = Gates([control_gate, view_gate], [self._view])
            self._authenticator = None if keys is None else Authenticator(self._context, keys.allowed, _ROLES)
            self._control.setsockopt(zmq.ROUTER_MANDATORY, 1)
            # A broken connection may come back before its end is noticed here.
            self._control.setsockopt(zmq.ROUTER_HANDOVER, 1)
            for part, endpoint, flag in ((self._control, control, "--bind"), (self._view, view, "--view-bind")):
                if keys is not None:
                    keys.secure(part)
                bind_socket(part, endpoint, flag)
            self.control_endpoint = self._control.getsockopt_string(zmq.LAST_ENDPOINT)
            """Bound address of the control socket, with the actual port."""
            self.view_endpoint = self._view.getsockopt_string(zmq.LAST_ENDPOINT)
            """Bound address of the view socket, with the actual port."""
        except BaseException:
            self.close()
            raise

    def news(self) -> list[str]:
        """Return lines to show that are new since the last call: refused keys, faults of keys, too many connections."""
        news: list[str] = []
        wrong = []
        if self.crowded:
            limit = self._ports.gates[0].connections.limit
            wrong.append(
                f"more than {limit} connections at once: new connections of strangers are closed, admitted peers stay"
            )
        if self._keys is not None and self._authenticator is not None:
            allowed = self._keys.allowed
            news = self._authenticator.news()
            wrong += [f"passed over, so that it lets nobody in: {fault}" for fault in allowed.faults]
            if allowed.unreadable is not None:
                who = "admitted peers stay" if allowed.names else "nobody is let in any more"
                wrong.append(f"{who}: {allowed.unreadable}")
        reported, self._reported = self._reported, wrong
        return news + [text for text in wrong if text not in reported]

    def cut_off_keys(self, keys: Collection[str]) -> None:
        """End all connections of these keys, which were revoked or have another role, and forget the peers."""
        self._watch_connections()
        for connection in [one for one in self._peers.connections.values() if one.peer.key in keys]:
            self._hang_up(connection)
            self._peers.forget(connection)
        for descriptor, (number, key) in [*self._viewers.items()]:
            if key in keys:
                self._hang_up_viewer(descriptor, number)

    def receive(self) -> list[tuple[bytes, bytes]]:
        """Return (peer, payload) of the control messages that have arrived, oldest first."""
        if self._authenticator is not None:
            self._authenticator.serve()
        now_s = self._clock.now()
        if (second := int(now_s)) != self._second:
            self._second = second
            crowd = self._ports.gates[1].connections
            self._asked = Counter({each: n for each, n in self._asked.items() if crowd.number(each[0]) == each[1]})
            self._peers.begin_second()
        self._watch_connections()
        self._read_subscriptions()
        received: list[tuple[bytes, bytes]] = []
        for name, *frames in self._inbox.read():
            connection = self._admitted(name.bytes, frames[-1] if frames else name)
            if connection is None:
                continue
            connection.peer.round_robin.heard(connection, now_s)
            if len(frames) == 1:
                received.append((connection.peer.name, frames[0].bytes))
            else:
                self.rejected += 1
        return received

    def send(self, peer: bytes, payload: bytes, *, everywhere: bool = False) -> bool:
        """Send to `peer`. Return False, and count in `dropped`, if it is gone, revoked, or does not keep up.

        everywhere: send over each of its connections, not only over the next. Raises ValueError for more than
        CONTROL_LIMIT_BYTES.
        """
        check_size(payload, CONTROL_LIMIT_BYTES)
        known = self._peers.get(peer)
        taken = (
            known is not None
            and self._allows(known.key)
            and known.round_robin.send(payload, self._clock.now(), everywhere=everywhere)
        )
        self.dropped += not taken
        return taken

    def tcp_figures(self, peer: bytes) -> TcpFigures:
        """Return the kernel's TCP figures of all connections to `peer`, added up."""
        known = self._peers.get(peer)
        return tcp_figures(
            [] if known is None else [each.descriptor for each in known.round_robin.connections if each.number]
        )

    def publish(self, topic: bytes, payload: bytes) -> None:
        """Send to all subscribers of `topic`; a viewer that does not keep up loses the message, others do not.

        Raises ValueError for more than VIEW_LIMIT_BYTES.
        """
        check_size(payload, VIEW_LIMIT_BYTES)
        self._read_subscriptions()
        self.dropped += self.offer(self._view, topic, payload) is not Offered.TAKEN

    def _read_subscriptions(self) -> None:
        """Take viewers' subscriptions; end a viewer whose key may not watch, or who asks for what there is not."""
        crowd = self._ports.gates[1].connections
        for _ in range(_SUBSCRIPTIONS_PER_CALL):
            if not readable(self._view):
                return
            with contextlib.suppress(zmq.ZMQError):  # its sender has left
                frame = self._view.recv(zmq.NOBLOCK, copy=False)
                asked, descriptor = frame.bytes, descriptor_of(frame)
                number, key = crowd.number(descriptor), "" if self._keys is None else user_of(frame)
                self._viewers = {each: who for each, who in self._viewers.items() if crowd.number(each) == who[0]}
                alike = sum(other == key for _, other in self._viewers.values()) if key else 0
                wrong = len(asked) > _LONGEST_TOPIC or asked[:1] not in (b"\x00", b"\x01")
                self._asked[descriptor, number] += 1
                greedy = self._asked[descriptor, number] > _MOST_SUBSCRIPTIONS or alike > KEY_CONNECTIONS
                if wrong or greedy or not self._allows(key):
                    self._flooding |= {key} if key and greedy else set()
                    self._hang_up_viewer(descriptor, number)
                    continue
                crowd.introduced(descriptor)
                if number:
                    self._viewers[descriptor] = number, key
                self._view.setsockopt(zmq.SUBSCRIBE if asked[0] else zmq.UNSUBSCRIBE, asked[1:])

    def _hang_up_viewer(self, descriptor: int, number: int) -> None:
        if self._ports.all_seen and number and self._ports.gates[1].connections.number(descriptor) == number:
            shut_down(descriptor)

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a control message, at most `timeout_s` (None: no limit); return whether there is one."""
        return self.wait_for(timeout_s, [self._inbox], self._authenticator)

    def cut_off(self, now_s: float) -> tuple[int, str]:
        """End connections beyond their budget; return the heaviest one's bytes since the last call, and whose."""
        self._watch_connections()
        size, descriptor, ended = self._ports.cut_off(now_s)
        self._flooding |= {key for each in ended if (key := self._key_at(each))}
        names = {} if self._keys is None else self._keys.allowed.names
        name = names.get(self._key_at(descriptor))
        return size, f"{'' if name is None else f'{name} at '}{peer_address(descriptor)}"

    def _key_at(self, descriptor: int) -> str:
        return self._viewers.get(descriptor, (0, ""))[1] or self._peers.key_at(descriptor)

    def present(self) -> dict[bytes, tuple[str, str]]:
        """Return key and address of the peers that have been heard, keyed by their names."""
        connections = self._peers.connections.values()
        return {each.peer.name: (each.peer.key, peer_address(each.descriptor)) for each in connections}

    def take_flooding(self) -> set[str]:
        """Return the keys that had too many connections, messages, bytes or subscriptions since the last call."""
        flooding, self._flooding = self._flooding, set()
        return flooding

    def _watch(self, part: "zmq.Socket[bytes]", unsent_bytes: int, bytes_per_s: float) -> Gate:
        return Gate(self._context, part, MOST_CONNECTIONS, SILENT_LIMIT_S, unsent_bytes, bytes_per_s)

    def _watch_connections(self) -> None:
        self.crowded += self._ports.update(self._clock.now())

    def _allows(self, key: str) -> bool:
        return self._keys is None or self._keys.allowed.admits(key, _ROLES)

    def _observes(self, key: str) -> bool:
        return self._keys is not None and self._keys.allowed.roles.get(key) == "observer"

    def _offer(self, connection: Connection, payload: bytes) -> Offered:
        self._inbox.used()
        return self.offer(self._control, connection.name, payload)

    def _admitted(self, name: bytes, frame: zmq.Frame) -> Connection | None:
        """Return the connection of a message; None if its key is not allowed or sends too much.

        In that case end all connections of the peer. frame: a frame of the message, by which ZeroMQ names the key and
        the descriptor.
        """
        key = "" if self._keys is None else user_of(frame)
        descriptor = descriptor_of(frame)
        connection, crowd = self._peers.connection(name, key), self._ports.gates[0].connections
        if descriptor != connection.descriptor or connection.number is None:
            self._watch_connections()
            # The previous connection, whose routing id was taken over: ZeroMQ neither reads nor ends it.
            self._hang_up(connection)
            connection.stands_for(descriptor, crowd.number(descriptor) if self._ports.all_seen else None)
        peer, is_allowed = connection.peer, self._allows(key)
        if is_allowed:
            crowd.introduced(descriptor)
        is_surplus = self._peers.count(peer) > PEER_LIMIT_PER_S
        is_surplus |= bool(key) and self._peers.of_key(key) > KEY_CONNECTIONS
        if is_allowed and not is_surplus:
            return connection
        barred = self._keys is not None and key in self._keys.allowed.barred
        self.flooding += is_allowed or barred
        self.revoked += not (is_allowed or barred)
        if is_allowed and key:
            self._flooding.add(key)
        self._watch_connections()
        number = crowd.number(descriptor)
        if self._ports.all_seen and number != connection.number and self._is_there(connection):
            connection.stands_for(descriptor, number)
        for each in peer.round_robin.connections:
            self._hang_up(each)
        return None

    def _is_there(self, connection: Connection) -> bool:
        """Return whether the peer of the connection is still connected, rather than only its last messages unread.

        To find out, send an empty message: ZeroMQ refuses it if the peer has left.
        """
        return self.offer(self._control, connection.name, b"") is not Offered.GONE

    def _hang_up(self, connection: Connection) -> None:
        """End a connection by its descriptor, so that it does not fill our memory; ZeroMQ has no call for that."""
        # A message may be read long after its sender left: the descriptor may belong to another connection by now.
        number, now_number = connection.number, self._ports.gates[0].connections.number(connection.descriptor)
        if self._ports.all_seen and not connection.hung_up and number and number == now_number:
            connection.hung_up = True
            shut_down(connection.descriptor)
