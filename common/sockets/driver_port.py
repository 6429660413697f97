"""Socket of the robot side to which a user's program connects: an arm's driver, or a perception of objects."""

from typing import Final, NamedTuple

import zmq

from common.sockets.authentication import Authenticator, RobotKeys
from common.sockets.endpoints import parse_bind, refuse_open
from common.sockets.inbox import Inbox
from common.sockets.readable import user_of
from common.sockets.round_robin import Offered
from common.sockets.shell import SocketShell, bind_socket

_HEARTBEAT_S: Final = 1.0
_HANDSHAKE_S: Final = 5.0


class Received(NamedTuple):
    """Received message, its sender, and the time at which it was taken from the socket, on our monotonic clock."""

    peer: bytes
    payload: bytes
    received_s: float


class DriverPort(SocketShell):
    """Bound socket for a user's program, which may connect and disconnect at any time.

    Keys are checked and peers refused as at the control port.
    """

    def __init__(
        self, bind: str, flag: str, limit_bytes: int, *, insecure: bool = False, keys: RobotKeys | None = None
    ) -> None:
        """Bind to the address `bind`, the value of `flag`. `limit_bytes`: largest valid message, at least 1 KiB.

        Raises ConfigurationError if the address is malformed, in use, or not this machine's. Also if it is open to the
        network with neither `keys` nor `insecure`.
        """
        endpoint = parse_bind(bind, flag)
        if keys is None and not insecure:
            refuse_open(endpoint, bind, flag)
        self.revoked = 0
        """Number of messages from peers whose keys were revoked after their handshake"""
        self._keys = keys
        super().__init__(_HEARTBEAT_S, _HANDSHAKE_S)
        try:
            self._authenticator = None if keys is None else Authenticator(self._context, keys.allowed)
            self._part = self._open_control(zmq.ROUTER)
            self._part.setsockopt(zmq.MAXMSGSIZE, limit_bytes)
            self._part.setsockopt(zmq.ROUTER_MANDATORY, 1)
            # A killed program may come back under its old name before its end is noticed.
            self._part.setsockopt(zmq.ROUTER_HANDOVER, 1)
            if keys is not None:
                keys.secure(self._part)
            bind_socket(self._part, endpoint, flag)
            self._inbox = Inbox(self._part, frames=2)
            self.endpoint = self._part.getsockopt_string(zmq.LAST_ENDPOINT)
            """Bound address; if `bind` left the port open, with the port that the system chose"""
        except BaseException:
            self.close()
            raise

    def receive(self) -> list[Received]:
        """Return the messages that have arrived, oldest first; never waits."""
        if self._authenticator is not None:
            self._authenticator.serve()
        received = []
        for name, *frames in self._inbox.read():
            if self._keys is not None and user_of(frames[-1] if frames else name) not in self._keys.allowed.names:
                self.revoked += 1
            elif len(frames) == 1:
                received.append(Received(name.bytes, frames[0].bytes, self._clock.now()))
            else:
                self.rejected += 1
        return received

    def send(self, peer: bytes, payload: bytes) -> bool:
        """Send at once. Return False, and count in `dropped`, if the peer is gone or does not keep up."""
        self._inbox.used()
        taken = self.offer(self._part, peer, payload) is Offered.TAKEN
        self.dropped += not taken
        return taken

    def refresh_keys(self) -> list[str]:
        """Read the allow-list again; return a line for each unknown key that was newly refused.

        Call it before other sockets with the same allow-list refresh it.
        """
        if self._keys is None or self._authenticator is None:
            return []
        self._keys.allowed.refresh()
        return self._authenticator.news()

    def wait(self, timeout_s: float) -> float:
        """Wait for a message, at most `timeout_s`; return the time on our monotonic clock."""
        self.wait_for(timeout_s, [self._inbox], self._authenticator)
        return self._clock.now()
