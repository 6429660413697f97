"""The operator side's end: it connects, and reconnects by itself."""

import contextlib
import threading
from collections.abc import Iterator, Sequence

import zmq

from common.sockets.authentication import HandshakeWatch, OperatorKeys
from common.sockets.endpoints import Endpoint, following, parse_connect
from common.sockets.inbox import Inbox
from common.sockets.shell import CONTROL_LIMIT_BYTES, SocketShell, connect_socket

_RETRY_S = 0.5
_ATTEMPT_LIMIT_S = 3.0
"""An attempt to connect that nobody has answered by then is made anew, by the host's address of then. The system by
itself asks again after 1, 2, 4... 64 s: a network that is back after a minute would stay unnoticed for another."""
_CLOSE_LIMIT_S = 0.5
_HANDSHAKE_LIMIT_S = 10.0
"""A CURVE handshake takes three round trips, seen from here, and the robot side may still be starting."""


class OperatorSockets(SocketShell):
    """The operator side's end: it connects, and reconnects by itself."""

    def __init__(
        self,
        connect: str,
        view_connect: str | None = None,
        *,
        topics: Sequence[bytes] = (b"",),
        keys: OperatorKeys | None = None,
        heartbeat_timeout_s: float = 3.0,
    ) -> None:
        """Connect control to `connect` and view to `view_connect`, by default the port after.

        `topics` are prefixes of the topics to receive; the empty one means all. The robot side need not be
        there yet. `heartbeat_timeout_s` as in RobotSockets. ConfigurationError when an address is malformed
        or its host unknown.
        """
        control = parse_connect(connect, "--connect")
        view = (
            following(control, connect, "--view-connect")
            if view_connect is None
            else parse_connect(view_connect, "--view-connect")
        )
        self._closing: threading.Thread | None = None
        self._watched: list[tuple[zmq.Socket[bytes], Endpoint, HandshakeWatch]] = []
        super().__init__(zmq.DEALER, zmq.SUB, heartbeat_timeout_s, _HANDSHAKE_LIMIT_S)
        try:
            # Nothing is queued for a robot that is not there: it would be replayed when it comes back.
            self._control.setsockopt(zmq.IMMEDIATE, 1)
            for topic in topics:
                self._view.setsockopt(zmq.SUBSCRIBE, topic)
            self._inbox, self._view_inbox = Inbox(self._control, frames=1), Inbox(self._view, frames=2)
            self._next_look_s = 0.0
            for part, endpoint, flag in ((self._control, control, "--connect"), (self._view, view, "--view-connect")):
                part.setsockopt(zmq.CONNECT_TIMEOUT, round(1e3 * _ATTEMPT_LIMIT_S))
                if keys is not None:
                    keys.secure(part)
                self._watched.append((part, endpoint, HandshakeWatch(part, keys)))
                connect_socket(part, endpoint, flag)
        except BaseException:
            self.close()
            raise

    @property
    def trouble(self) -> str | None:
        """Why the robot side does not let us in, and what to do about it; None as far as we know."""
        return next((watch.trouble for _, _, watch in self._watched if watch.trouble is not None), None)

    @property
    def key_refused(self) -> bool:
        """Whether `trouble` is that our key is not let in."""
        return any(watch.key_refused for _, _, watch in self._watched)

    def receive(self) -> list[bytes]:
        """Every control message that has arrived, oldest first."""
        self._look_after_handshakes()
        return [payload.bytes for (payload,) in self._whole(self._inbox.read(), 1)]

    def receive_view(self) -> list[tuple[bytes, bytes]]:
        """(topic, payload) of every view message that has arrived, oldest first."""
        messages = self._whole(self._view_inbox.read(), 2)
        return [(topic.bytes, payload.bytes) for topic, payload in messages]

    def send(self, payload: bytes) -> bool:
        """Send to the robot side; False, and counted in `dropped`, when it is gone or does not keep up.

        ValueError for more than CONTROL_LIMIT_BYTES.
        """
        self._inbox.used()
        return self.send_frames(self._control, [payload], CONTROL_LIMIT_BYTES)

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a control or view message, at most `timeout_s` (None: no limit); whether there is one."""
        return self.wait_for(timeout_s, [self._inbox, self._view_inbox])

    def close(self) -> None:
        """Close at once, whatever has not left yet; closing twice does no harm."""
        if self._closing is not None:
            return
        # ZeroMQ would wait for its own threads, and they for a name server that does not answer.
        self._closing = threading.Thread(target=self._end, daemon=True)
        self._closing.start()
        self._closing.join(_CLOSE_LIMIT_S)

    def _end(self) -> None:
        for _, _, watch in self._watched:
            watch.close()
        super().close()

    def _whole(self, messages: Iterator[list[zmq.Frame]], frames: int) -> Iterator[list[zmq.Frame]]:
        """The messages of that many frames; others are rejected and counted."""
        for message in messages:
            if len(message) == frames:
                yield message
            else:
                self.rejected += 1

    def _look_after_handshakes(self) -> None:
        """After a refused handshake ZeroMQ gives up; we knock again, for the key may be allowed by then."""
        now_s = self._clock.now()
        if now_s < self._next_look_s:
            return
        self._next_look_s = now_s + _RETRY_S
        for part, endpoint, watch in self._watched:
            watch.look()
            if watch.failed:
                watch.failed = False
                self._inbox.used()
                self._view_inbox.used()
                with contextlib.suppress(zmq.ZMQError):
                    part.disconnect(endpoint.address)
                part.connect(endpoint.address)
