"""Sockets of the robot side: they distinguish peers, and cut off floods and revoked keys."""

import contextlib
import select

import zmq

from common.errors import ConfigurationError
from common.sockets.authentication import Authenticator, RobotKeys
from common.sockets.descriptors import shut_down
from common.sockets.endpoints import Endpoint, following, parse_bind, refuse_open
from common.sockets.gate import Gate
from common.sockets.inbox import Inbox
from common.sockets.peers import Connection, Peers
from common.sockets.readable import EVENTS, descriptor_of, user_of
from common.sockets.shell import (
    CONTROL_LIMIT_BYTES,
    CONTROL_UNSENT_BYTES,
    VIEW_LIMIT_BYTES,
    VIEW_UNSENT_BYTES,
    SocketShell,
    bind_socket,
    check_size,
)
from common.sockets.tcp_figures import TcpFigures, tcp_figures
from common.sockets.turns import Offered

PEER_LIMIT_PER_S = 5000
"""Messages a second at which a key, or without keys a peer, is cut off: 20 times an operator's rate, and twice a
backlog of ten seconds."""
HANDSHAKE_LIMIT_S = 5.0
"""Time limit of a handshake, in seconds: CURVE takes two round trips from here, of 2 s at most in a session."""
MOST_CONNECTIONS = 1024
"""Connections to each port; at most a quarter of the descriptors that this process may open."""
_EVENTS_PER_CALL = 256
"""Events of each port, 5 us each: a storm of connections cannot block the caller."""


class RobotSockets(SocketShell):
    """Sockets of the robot side: they bind, distinguish peers, and with keys admit only allowed ones."""

    def __init__(
        self,
        bind: str,
        view_bind: str | None = None,
        *,
        insecure: bool = False,
        keys: RobotKeys | None = None,
        heartbeat_timeout_s: float = 3.0,
    ) -> None:
        """Bind control to `bind` and view to `view_bind`, by default the port after.

        A silent connection ends after `heartbeat_timeout_s`, which must exceed the link's real one-way delay. Raises
        ConfigurationError for an address that is malformed, in use, not this machine's, or open to the network with
        neither `keys` nor `insecure`.
        """
        control = parse_bind(bind, "--bind")
        view = following(control, bind, "--view-bind") if view_bind is None else parse_bind(view_bind, "--view-bind")
        if keys is None and not insecure:
            refuse_open(control, bind, "--bind")
            refuse_open(view, view_bind or bind, "--view-bind")
        self.flooding = 0
        """Number of messages above PEER_LIMIT_PER_S."""
        self.revoked = 0
        """Number of messages under keys revoked since their handshake."""
        self._keys = keys
        self.crowded = 0
        """Number of connections that were ended as surplus."""
        self._reported: list[str] = []
        self._peers = Peers(self._offer)
        self._all_seen = False
        """Whether the gates had processed all events of connections."""
        self._second = 0
        self._view_endpoint: Endpoint | None = None
        self._view_outdated = False
        super().__init__(heartbeat_timeout_s, HANDSHAKE_LIMIT_S)
        try:
            self._control, self._view = self._open_control(zmq.ROUTER), self._open_view(zmq.PUB)
            self._inbox = Inbox(self._control, frames=2)
            self._gates = [self._watch(self._control, CONTROL_UNSENT_BYTES), self._watch(self._view, VIEW_UNSENT_BYTES)]
            self._listen()
            self._authenticator = None if keys is None else Authenticator(self._context, keys.allowed)
            self._control.setsockopt(zmq.ROUTER_MANDATORY, 1)
            # A broken connection may come back before its end is noticed here.
            self._control.setsockopt(zmq.ROUTER_HANDOVER, 1)
            for part, endpoint, flag in ((self._control, control, "--bind"), (self._view, view, "--view-bind")):
                if keys is not None:
                    keys.secure(part)
                bind_socket(part, endpoint, flag)
            self.control_endpoint = self._control.getsockopt_string(zmq.LAST_ENDPOINT)
            """Bound address of control, with the port that the system chose."""
            self.view_endpoint = self._view.getsockopt_string(zmq.LAST_ENDPOINT)
            """Bound address of view, with the port that the system chose."""
        except BaseException:
            self.close()
            raise

    @property
    def refused(self) -> int:
        """Number of handshakes with a key that is not allowed."""
        return 0 if self._authenticator is None else self._authenticator.refused

    def news(self) -> list[str]:
        """Return news of strangers and keys since the last call, a line each."""
        news: list[str] = []
        wrong = []
        if self.crowded:
            limit = self._gates[0].connections.limit
            wrong.append(f"more than {limit} connections at once: new strangers are cut off, admitted peers stay")
        if self._keys is not None and self._authenticator is not None:
            allowed = self._keys.allowed
            news = self._authenticator.news()
            wrong += [f"passed over, so that it lets nobody in: {fault}" for fault in allowed.faults]
            if allowed.unreadable is not None:
                who = "admitted peers stay" if allowed.names else "nobody is let in any more"
                wrong.append(f"{who}: {allowed.unreadable}")
        reported, self._reported = self._reported, wrong
        return news + [text for text in wrong if text not in reported]

    def refresh_keys(self) -> None:
        """Refresh the allow-list, and cut off revoked peers; call a few times a second."""
        if self._keys is None:
            return
        revoked = self._keys.allowed.refresh()
        if revoked:
            self._watch_connections()
            for connection in self._peers.connections.values():
                if connection.peer.key in revoked:
                    self._hang_up(connection)
            self._view_outdated = True
        if self._view_outdated:
            with contextlib.suppress(zmq.ZMQError):  # no descriptor left: the next call tries again
                self._replace_view(self._keys)
        self._bind_view_again()

    def receive(self) -> list[tuple[bytes, bytes]]:
        """Return (peer, payload) of the control messages that have arrived, oldest first."""
        if self._authenticator is not None:
            self._authenticator.serve()
        now_s = self._clock.now()
        if (second := int(now_s)) != self._second:
            self._second = second
            self._peers.begin_second()
        self._watch_connections()
        received: list[tuple[bytes, bytes]] = []
        for name, *frames in self._inbox.read():
            connection = self._admitted(name.bytes, frames[-1] if frames else name)
            if connection is None:
                continue
            connection.peer.turns.heard(connection, now_s)
            if len(frames) == 1:
                received.append((connection.peer.name, frames[0].bytes))
            else:
                self.rejected += 1
        return received

    def send(self, peer: bytes, payload: bytes, *, everywhere: bool = False) -> bool:
        """Send to `peer`; False, and counted in `dropped`, if it is gone, revoked, or does not keep up.

        everywhere: over each connection, not only the next. Raises ValueError for more than CONTROL_LIMIT_BYTES.
        """
        check_size(payload, CONTROL_LIMIT_BYTES)
        known = self._peers.get(peer)
        taken = (
            known is not None
            and self._allows(known.key)
            and known.turns.send(payload, self._clock.now(), everywhere=everywhere)
        )
        self.dropped += not taken
        return taken

    def tcp_figures(self, peer: bytes) -> TcpFigures:
        """Return the sum of the kernel's figures of the connections to `peer`."""
        known = self._peers.get(peer)
        return tcp_figures(
            [] if known is None else [each.descriptor for each in known.turns.connections if each.number]
        )

    def publish(self, topic: bytes, payload: bytes) -> None:
        """Send to the subscribers of `topic`; only a viewer that does not keep up loses the message.

        Raises ValueError for more than VIEW_LIMIT_BYTES.
        """
        check_size(payload, VIEW_LIMIT_BYTES)
        self._bind_view_again()
        self.dropped += self.offer(self._view, topic, payload) is not Offered.TAKEN

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a control message, at most `timeout_s` (None: no limit); return whether there is one."""
        return self.wait_for(timeout_s, [self._inbox], self._authenticator)

    def _watch(self, part: "zmq.Socket[bytes]", unsent_bytes: int) -> Gate:
        return Gate(self._context, part, MOST_CONNECTIONS, HANDSHAKE_LIMIT_S, unsent_bytes)

    def _listen(self) -> None:
        """Poll the gates and the view from now on; present events are processed anyway."""
        self._comings = select.poll()
        for part in (self._view, *(gate.events for gate in self._gates)):
            self._comings.register(part.fileno(), select.POLLIN)
        self._all_seen = False

    def _watch_connections(self) -> None:
        """Process both ports' arrivals and ends since the last call, and end surplus connections.

        A descriptor may belong to another connection by now, even at the other port. The owners are known only when
        neither gate has another event. After more events than one call takes, nobody is hung up on.
        """
        if self._all_seen and not self._comings.poll(0):
            return
        # Events of the view's connections pile up until its socket is used.
        self._view.getsockopt(EVENTS)
        now_s = self._clock.now()
        self._all_seen = False
        for _ in range(_EVENTS_PER_CALL):
            looks = [gate.look(now_s) for gate in self._gates]
            if not any(looks):
                self._all_seen = True
                break
        else:
            return
        for gate in self._gates:
            for descriptor in gate.connections.surplus(now_s):
                shut_down(descriptor)
                self.crowded += 1

    def _replace_view(self, keys: RobotKeys) -> None:
        """Make another view socket: a PUB socket cannot cut off single viewers, so that all must authenticate again."""
        view = self._open_view(zmq.PUB)
        try:
            keys.secure(view)
            gate = self._watch(view, VIEW_UNSENT_BYTES)
        except zmq.ZMQError:
            view.close(linger=0)
            raise
        self._gates[1].close()
        self._view.close(linger=0)
        self._view, self._gates[1], self._view_outdated = view, gate, False
        self._listen()
        self._view_endpoint = parse_bind(self.view_endpoint, "--view-bind")

    def _bind_view_again(self) -> None:
        """Bind the new view: after a revocation the port is free only when ZeroMQ's thread has closed the old one."""
        if self._view_endpoint is not None:
            with contextlib.suppress(ConfigurationError):
                bind_socket(self._view, self._view_endpoint, "--view-bind")
                self._view_endpoint = None

    def _allows(self, key: str) -> bool:
        return self._keys is None or key in self._keys.allowed.names

    def _offer(self, connection: Connection, payload: bytes) -> Offered:
        self._inbox.used()
        return self.offer(self._control, connection.name, payload)

    def _admitted(self, name: bytes, frame: zmq.Frame) -> Connection | None:
        """Return the connection of one message if it may be decoded; each frame names its sender."""
        key = "" if self._keys is None else user_of(frame)
        descriptor = descriptor_of(frame)
        connection, crowd = self._peers.connection(name, key), self._gates[0].connections
        if descriptor != connection.descriptor or connection.number is None:
            self._watch_connections()
            # The previous connection, whose routing id was taken over: ZeroMQ neither reads nor ends it.
            self._hang_up(connection)
            connection.stands_for(descriptor, crowd.number(descriptor) if self._all_seen else None)
        peer, is_allowed = connection.peer, self._allows(key)
        if is_allowed:
            crowd.introduced(descriptor)
        is_surplus = self._peers.count(peer) > PEER_LIMIT_PER_S
        if is_allowed and not is_surplus:
            return connection
        self.flooding += is_allowed
        self.revoked += not is_allowed
        self._watch_connections()
        number = crowd.number(descriptor)
        if self._all_seen and number != connection.number and self._is_there(connection):
            connection.stands_for(descriptor, number)
        for each in peer.turns.connections:
            self._hang_up(each)
        return None

    def _is_there(self, connection: Connection) -> bool:
        """Return whether the connection is back under an old descriptor, and has not only left messages behind.

        ZeroMQ refuses even an empty message to a peer that has left.
        """
        return self.offer(self._control, connection.name, b"") is not Offered.GONE

    def _hang_up(self, connection: Connection) -> None:
        """End a connection, so that it does not fill our memory; ZeroMQ has no call for that."""
        # A message may be read long after its sender left: the descriptor may belong to another connection by now.
        number, now_number = connection.number, self._gates[0].connections.number(connection.descriptor)
        if self._all_seen and not connection.hung_up and number and number == now_number:
            connection.hung_up = True
            shut_down(connection.descriptor)
