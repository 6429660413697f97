"""Sockets of the operator side, which connect to the robot side and reconnect by themselves."""

import contextlib
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import zmq

from common.sockets.authentication import HandshakeWatch, OperatorKeys
from common.sockets.endpoints import Endpoint, parse_connect, view_after
from common.sockets.inbox import Inbox
from common.sockets.round_robin import (
    CONNECTIONS,
    MOST_CONNECTIONS_EACH,
    Offered,
    RoundRobin,
    RoundRobinConnection,
    new_group,
    routing_id,
)
from common.sockets.shell import (
    CONTROL_LIMIT_BYTES,
    CONTROL_UNSENT_BYTES,
    VIEW_UNSENT_BYTES,
    SocketShell,
    check_size,
    connect_socket,
)

_RETRY_S = 0.5
_ATTEMPT_LIMIT_S = 3.0
"""Time limit of an attempt to connect, in seconds; then the host name is resolved again. Without it the system retries
after 1, 2, 4... 64 s, and would notice a network that is back after a minute only a minute later."""
_CLOSE_LIMIT_S = 0.5
_HANDSHAKE_LIMIT_S = 10.0
"""Time limit of a handshake, in seconds: CURVE takes the client three round trips, and the robot side may be
starting."""


@dataclass(eq=False)
class _Connection(RoundRobinConnection):
    """Control connection to the robot side, with its own socket."""

    part: "zmq.Socket[bytes]"
    inbox: Inbox


class OperatorSockets(SocketShell):
    """Sockets of the operator side, which connect to the robot side and reconnect by themselves."""

    def __init__(
        self,
        connect: str,
        view_connect: str | None = None,
        *,
        topics: Sequence[bytes] = (b"",),
        keys: OperatorKeys | None = None,
        heartbeat_timeout_s: float = 3.0,
        connections: int = CONNECTIONS,
    ) -> None:
        """Connect `connections` control sockets to `connect`, and the view socket to `view_connect`.

        `view_connect` None: the port after that of `connect`. `topics`: prefixes of the view topics to receive; the
        empty prefix means all. `heartbeat_timeout_s`: as in RobotSockets. The robot side need not run yet. Raises
        ConfigurationError for a malformed address or unknown host, ValueError for fewer than 1 or more than 16
        connections.
        """
        if not 1 <= connections <= MOST_CONNECTIONS_EACH:
            raise ValueError(f"connections = {connections}; valid: 1 to {MOST_CONNECTIONS_EACH}")
        control = parse_connect(connect, "--connect")
        view = (
            view_after(control, connect, "--view-connect")
            if view_connect is None
            else parse_connect(view_connect, "--view-connect")
        )
        self._closing: threading.Thread | None = None
        self._watched: list[tuple[zmq.Socket[bytes], Endpoint, HandshakeWatch]] = []
        self._connections: list[_Connection] = []
        self._round_robin: RoundRobin[_Connection] = RoundRobin(self._offer)
        super().__init__(heartbeat_timeout_s, _HANDSHAKE_LIMIT_S)
        group, self._next_look_s = new_group(), 0.0
        try:
            # ZeroMQ connects a socket once to the same address, hence a socket for each connection.
            for index in range(connections):
                part = self._open_control(zmq.DEALER)
                part.setsockopt(zmq.ROUTING_ID, routing_id(group, index))
                # Queue nothing for an absent robot: old messages would arrive when it comes back.
                part.setsockopt(zmq.IMMEDIATE, 1)
                self._connections.append(_Connection(part, Inbox(part, frames=1)))
                self._join(part, control, "--connect", keys, CONTROL_UNSENT_BYTES)
            self._round_robin.connections.extend(self._connections)
            self._view = self._open_view(zmq.SUB)
            for topic in topics:
                self._view.setsockopt(zmq.SUBSCRIBE, topic)
            self._view_inbox = Inbox(self._view, frames=2)
            self._join(self._view, view, "--view-connect", keys, VIEW_UNSENT_BYTES)
            self._awaited = [*(connection.inbox for connection in self._connections), self._view_inbox]
        except BaseException:
            self.close()
            raise

    @property
    def trouble(self) -> str | None:
        """Reason why the robot side refuses us, with a remedy; None if unknown."""
        return next((watch.trouble for _, _, watch in self._watched if watch.trouble is not None), None)

    @property
    def key_refused(self) -> bool:
        """Whether `trouble` is a refused key."""
        return any(watch.key_refused for _, _, watch in self._watched)

    def receive(self) -> list[bytes]:
        """Return the control messages that have arrived, connection by connection, each one's oldest first."""
        self._look_after_handshakes()
        return [
            payload.bytes for connection in self._connections for (payload,) in self._whole(connection.inbox.read(), 1)
        ]

    def receive_view(self) -> list[tuple[bytes, bytes]]:
        """Return (topic, payload) of the view messages that have arrived, oldest first."""
        messages = self._whole(self._view_inbox.read(), 2)
        return [(topic.bytes, payload.bytes) for topic, payload in messages]

    def send(self, payload: bytes, *, everywhere: bool = False) -> bool:
        """Send to the robot side. Return False, and count in `dropped`, if it is gone or does not keep up.

        everywhere: send over each connection, not only over the next. Raises ValueError for more than
        CONTROL_LIMIT_BYTES.
        """
        check_size(payload, CONTROL_LIMIT_BYTES)
        taken = self._round_robin.send(payload, self._clock.now(), everywhere=everywhere)
        self.dropped += not taken
        return taken

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a control or view message, at most `timeout_s` (None: no limit); return whether there is one."""
        return self.wait_for(timeout_s, self._awaited)

    def close(self) -> None:
        """Close at once and drop unsent messages; closing twice does no harm."""
        if self._closing is not None:
            return
        # ZeroMQ would wait for its threads, and they for a name server that does not answer.
        self._closing = threading.Thread(target=self._end, daemon=True)
        self._closing.start()
        self._closing.join(_CLOSE_LIMIT_S)

    def _end(self) -> None:
        for _, _, watch in self._watched:
            watch.close()
        super().close()

    def _join(
        self, part: "zmq.Socket[bytes]", endpoint: Endpoint, flag: str, keys: OperatorKeys | None, unsent_bytes: int
    ) -> None:
        part.setsockopt(zmq.CONNECT_TIMEOUT, round(1e3 * _ATTEMPT_LIMIT_S))
        if keys is not None:
            keys.secure(part)
        self._watched.append((part, endpoint, HandshakeWatch(part, keys, unsent_bytes)))
        connect_socket(part, endpoint, flag)

    def _offer(self, connection: _Connection, payload: bytes) -> Offered:
        connection.inbox.used()
        return self.offer(connection.part, payload)

    def _whole(self, messages: Iterator[list[zmq.Frame]], frames: int) -> Iterator[list[zmq.Frame]]:
        """Yield the messages that have `frames` frames; others are counted in `rejected`."""
        for message in messages:
            if len(message) == frames:
                yield message
            else:
                self.rejected += 1

    def _look_after_handshakes(self) -> None:
        """Connect again after a refused handshake: ZeroMQ does not, but the key may have been allowed since."""
        now_s = self._clock.now()
        if now_s < self._next_look_s:
            return
        self._next_look_s = now_s + _RETRY_S
        for part, endpoint, watch in self._watched:
            watch.poll()
            if watch.failed:
                watch.failed = False
                for inbox in self._awaited:
                    inbox.used()
                with contextlib.suppress(zmq.ZMQError):
                    part.disconnect(endpoint.address)
                part.connect(endpoint.address)
