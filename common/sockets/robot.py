"""The robot side's end: it binds, tells its peers apart, and sends floods and revoked keys away."""

import contextlib
import select
import socket
from dataclasses import dataclass

import zmq

from common.errors import ConfigurationError
from common.sockets.authentication import Authenticator, RobotKeys
from common.sockets.endpoints import Endpoint, following, parse_bind, refuse_open
from common.sockets.gate import Gate
from common.sockets.inbox import Inbox
from common.sockets.readable import EVENTS
from common.sockets.shell import CONTROL_LIMIT_BYTES, VIEW_LIMIT_BYTES, SocketShell, bind_socket

PEER_LIMIT_PER_S = 5000
"""A peer that sends more is cut off: 20 times what an operator sends, and twice a backlog of ten seconds."""
HANDSHAKE_LIMIT_S = 5.0
"""A connection that has not introduced itself by then ends. A CURVE handshake takes two round trips, seen from here, of
2 s at most in a session."""
MOST_CONNECTIONS = 1024
"""To each port, and never more than a quarter of the descriptors that this process may open."""
_REMEMBERED_PEERS = 1024
_EVENTS_PER_CALL = 256
"""Events of each port, 5 us each: connections that come and go cannot hold the caller."""


@dataclass
class _Peer:
    """The robot side's memory of one connection."""

    key: str
    """Whom it authenticated as; empty without keys."""
    descriptor: int = -1
    """The descriptor that the last message came by; -1 where it is not known."""
    connection: int | None = None
    """The number of that connection in the crowd; 0 for one that ended, None while unknown."""
    received: int = 0
    """Messages in the present second."""


class RobotSockets(SocketShell):
    """The robot side's end: it binds, tells its peers apart, and with keys lets nobody in but who is allowed."""

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

        A silent connection ends after `heartbeat_timeout_s`, which must exceed the link's real one-way delay.
        ConfigurationError when an address is malformed, in use, not this machine's, or open to the network
        with neither `keys` nor `insecure`.
        """
        control = parse_bind(bind, "--bind")
        view = following(control, bind, "--view-bind") if view_bind is None else parse_bind(view_bind, "--view-bind")
        if keys is None and not insecure:
            refuse_open(control, bind, "--bind")
            refuse_open(view, view_bind or bind, "--view-bind")
        self.flooding = 0
        """Messages of peers that sent more than anybody may."""
        self.revoked = 0
        """Messages of peers that were allowed when they connected, and are no more."""
        self._keys = keys
        self.crowded = 0
        """Connections that were ended because there were too many at once."""
        self._told: list[str] = []
        self._peers: dict[bytes, _Peer] = {}
        self._all_seen = False
        """Whether what the gates know of the connections was all there was to know."""
        self._second = 0
        self._view_endpoint: Endpoint | None = None
        self._view_outdated = False
        super().__init__(zmq.ROUTER, zmq.PUB, heartbeat_timeout_s, HANDSHAKE_LIMIT_S)
        self._inbox = Inbox(self._control, frames=2)
        try:
            self._gates = [self._watch(part) for part in (self._control, self._view)]
            self._listen()
            self._authenticator = None if keys is None else Authenticator(self._context, keys.allowed)
            self._control.setsockopt(zmq.ROUTER_MANDATORY, 1)
            for part, endpoint, flag in ((self._control, control, "--bind"), (self._view, view, "--view-bind")):
                if keys is not None:
                    keys.secure(part)
                bind_socket(part, endpoint, flag)
            self.control_endpoint = self._control.getsockopt_string(zmq.LAST_ENDPOINT)
            """The address that control is bound to, with the port that the system chose."""
            self.view_endpoint = self._view.getsockopt_string(zmq.LAST_ENDPOINT)
            """The address that view is bound to, with the port that the system chose."""
        except BaseException:
            self.close()
            raise

    @property
    def refused(self) -> int:
        """Handshakes with a key that is not allowed."""
        return 0 if self._authenticator is None else self._authenticator.refused

    def news(self) -> list[str]:
        """News of strangers and keys since the last call, a line each."""
        news, wrong = [], []
        if self.crowded:
            limit = self._gates[0].crowd.limit
            wrong.append(f"more than {limit} connections at once: strangers are hung up on; who is in stays in")
        if self._keys is not None and self._authenticator is not None:
            allowed = self._keys.allowed
            news = [
                f"refused an unknown key; to let it in: {allowed.folder.command(f'allow NAME {key}')}"
                for key in self._authenticator.unknown_keys()
            ]
            wrong += [f"passed over, so that it lets nobody in: {fault}" for fault in allowed.faults]
            if allowed.unreadable is not None:
                who = "whoever was let in stays so" if allowed.names else "nobody is let in any more"
                wrong.append(f"{who}: {allowed.unreadable}")
        told, self._told = self._told, wrong
        return news + [text for text in wrong if text not in told]

    def refresh_keys(self) -> None:
        """Look whether the allow-list has changed, and cut off whoever it names no more; a few times a second."""
        if self._keys is None:
            return
        revoked = self._keys.allowed.refresh()
        if revoked:
            self._watch_connections()
            for name in [name for name, peer in self._peers.items() if peer.key in revoked]:
                self._hang_up(name)
            self._view_outdated = True
        if self._view_outdated:
            with contextlib.suppress(zmq.ZMQError):  # while no descriptor is to be had, the next look tries again
                self._replace_view(self._keys)
        self._bind_view_again()

    def receive(self) -> list[tuple[bytes, bytes]]:
        """(peer, payload) of every control message that has arrived, oldest first."""
        if self._authenticator is not None:
            self._authenticator.serve()
        if (second := int(self._clock.now())) != self._second:
            self._second = second
            for peer in self._peers.values():
                peer.received = 0
        self._watch_connections()
        received: list[tuple[bytes, bytes]] = []
        for name, *frames in self._inbox.read():
            if not self._admits(name.bytes, frames[-1] if frames else name):
                continue
            if len(frames) == 1:
                received.append((name.bytes, frames[0].bytes))
            else:
                self.rejected += 1
        return received

    def send(self, peer: bytes, payload: bytes) -> bool:
        """Send to `peer`; False, and counted in `dropped`, when it is gone, revoked, or does not keep up.

        ValueError for more than CONTROL_LIMIT_BYTES.
        """
        if self._keys is not None and (peer not in self._peers or not self._allows(self._peers[peer].key)):
            self.dropped += 1
            return False
        self._inbox.used()
        return self.send_frames(self._control, [peer, payload], CONTROL_LIMIT_BYTES)

    def publish(self, topic: bytes, payload: bytes) -> None:
        """Send to whoever subscribed to `topic`; a viewer that does not keep up loses it, alone.

        ValueError for more than VIEW_LIMIT_BYTES.
        """
        self._bind_view_again()
        self.send_frames(self._view, [topic, payload], VIEW_LIMIT_BYTES)

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a control message, at most `timeout_s` (None: no limit); whether there is one."""
        return self.wait_for(timeout_s, [self._inbox], self._authenticator)

    def _watch(self, part: "zmq.Socket[bytes]") -> Gate:
        return Gate(self._context, part, MOST_CONNECTIONS, HANDSHAKE_LIMIT_S)

    def _listen(self) -> None:
        """Be told when there is something at the gates or the view; whatever is there already is looked at anyway."""
        self._comings = select.poll()
        for part in (self._view, *(gate.events for gate in self._gates)):
            self._comings.register(part.fileno(), select.POLLIN)
        self._all_seen = False

    def _watch_connections(self) -> None:
        """Take note of who has come and gone at both ports since it was last looked, and hang up on who is too many.

        A descriptor may stand for another connection by now, at the other port, too: only when a last look has found
        nothing new at either is each known to be whose it is. With more than one call takes in, nobody is hung up on.
        """
        if self._all_seen and not self._comings.poll(0):
            return
        # Connections that come and go at the view pile up until its socket is asked anything.
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
            for descriptor in gate.crowd.surplus(now_s):
                _shut_down(descriptor)
                self.crowded += 1

    def _replace_view(self, keys: RobotKeys) -> None:
        """Nothing can be sent to some viewers and not to others: all of them have to shake hands anew."""
        view = self._open_view(zmq.PUB)
        try:
            keys.secure(view)
            gate = self._watch(view)
        except zmq.ZMQError:
            view.close(linger=0)
            raise
        self._gates[1].close()
        self._view.close(linger=0)
        self._view, self._gates[1], self._view_outdated = view, gate, False
        self._listen()
        self._view_endpoint = parse_bind(self.view_endpoint, "--view-bind")

    def _bind_view_again(self) -> None:
        """After a revocation: the old socket's port is free only when ZeroMQ's own thread has closed it."""
        if self._view_endpoint is not None:
            with contextlib.suppress(ConfigurationError):
                bind_socket(self._view, self._view_endpoint, "--view-bind")
                self._view_endpoint = None

    def _allows(self, key: str) -> bool:
        return self._keys is None or key in self._keys.allowed.names

    def _admits(self, name: bytes, frame: zmq.Frame) -> bool:
        """Whether one message of `name` may be looked into; who sent it stands with each frame."""
        key = "" if self._keys is None else _property(frame, "User-Id")
        peer = self._peers.get(name)
        if peer is None or peer.key != key:
            if len(self._peers) >= _REMEMBERED_PEERS:
                del self._peers[next(iter(self._peers))]
            peer = self._peers[name] = _Peer(key)
        crowd, descriptor = self._gates[0].crowd, _descriptor(frame)
        if descriptor != peer.descriptor or peer.connection is None:
            self._watch_connections()
            peer.descriptor, peer.connection = descriptor, crowd.number(descriptor) if self._all_seen else None
        if self._allows(key):
            crowd.spoke(descriptor)
        peer.received += 1
        if not self._allows(key):
            self.revoked += 1
            self._hang_up(name)
            return False
        if peer.received > PEER_LIMIT_PER_S:
            self.flooding += 1
            self._hang_up(name)
            return False
        return True

    def _hang_up(self, name: bytes) -> None:
        """End the connection of `name`, so that it does not go on to fill our memory; ZeroMQ has no call for that."""
        peer = self._peers[name]
        # A message may be read long after its sender left: the descriptor may stand for another connection by now.
        if self._all_seen and peer.connection and self._gates[0].crowd.number(peer.descriptor) == peer.connection:
            peer.connection = 0
            _shut_down(peer.descriptor)


def _shut_down(descriptor: int) -> None:
    """End a connection that ZeroMQ owns and will close; without a descriptor more, as there may be none left."""
    with contextlib.suppress(OSError):  # it may have gone this moment
        connection = socket.socket(socket.AF_INET, socket.SOCK_STREAM, fileno=descriptor)
        try:
            connection.shutdown(socket.SHUT_RDWR)
        finally:
            connection.detach()


def _property(frame: zmq.Frame, name: str) -> str:
    """A property of the connection that `frame` came by; empty where ZeroMQ has none."""
    try:
        return str(frame.get(name))
    except zmq.ZMQError:
        return ""


def _descriptor(frame: zmq.Frame) -> int:
    try:
        return int(frame.get(zmq.SRCFD))
    except zmq.ZMQError:
        return -1
