"""Socket of the robot side to which a user's program connects: an arm's driver, a perception of objects, or cameras."""

from collections import Counter
from typing import Final, NamedTuple

import zmq

from common.sockets.authentication import Authenticator, RobotKeys
from common.sockets.descriptors import shut_down
from common.sockets.endpoints import parse_driver
from common.sockets.gate import Gate, Gates
from common.sockets.inbox import Inbox
from common.sockets.key_files import KeyRole
from common.sockets.readable import descriptor_of, user_of
from common.sockets.round_robin import Offered
from common.sockets.shell import CONTROL_UNSENT_BYTES, SocketShell, bind_socket
from common.sockets.tcp_figures import peer_address

BYTES_PER_S: Final = 64e6
"""Budget of a connection's bytes, if the caller has none: a perception's largest frames at 60 Hz"""
PEER_LIMIT_PER_S: Final = 2000
"""Maximum number of messages a second from one key, or without keys from one peer: twice those of an arm at 1 kHz"""
MOST_CONNECTIONS: Final = 64
_HEARTBEAT_S: Final = 1.0
_HANDSHAKE_S: Final = 5.0
_SILENT_S: Final = 30.0
"""Time after which a connection that has said nothing is ended, in seconds; one that sends later connects again"""


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
        self,
        bind: str,
        flag: str,
        limit_bytes: int,
        *,
        insecure: bool = False,
        keys: RobotKeys | None = None,
        role: KeyRole = "driver",
        bytes_per_s: float = BYTES_PER_S,
    ) -> None:
        """Bind to the address `bind`, the value of `flag`. `limit_bytes`: largest valid message, at least 1 KiB.
        `role`: role of the keys that are let in. `bytes_per_s`: budget of each connection.

        Raises ConfigurationError if the address is malformed, in use, or not this machine's. Also if it is open to the
        network with neither `keys` nor `insecure`.
        """
        endpoint = parse_driver(bind, flag, guarded=insecure or keys is not None)
        self.revoked = self.flooding = self.crowded = 0
        """Numbers of messages from peers whose keys were revoked after their handshake, of messages above
        PEER_LIMIT_PER_S, and of connections that were ended because of MOST_CONNECTIONS"""
        self._keys, self._role = keys, role
        self._heard: dict[bytes, tuple[str, int]] = {}
        """Key and descriptor of the peers that were heard in this second or the last one"""
        self._heard_before: dict[bytes, tuple[str, int]] = {}
        self._counted: Counter[bytes | str] = Counter()
        self._second = 0
        self._flooding: set[str] = set()
        super().__init__(_HEARTBEAT_S, _HANDSHAKE_S)
        try:
            self._authenticator = None if keys is None else Authenticator(self._context, keys.allowed, (role,))
            self._part = self._open_control(zmq.ROUTER)
            self._part.setsockopt(zmq.MAXMSGSIZE, limit_bytes)
            self._part.setsockopt(zmq.ROUTER_MANDATORY, 1)
            # A killed program may come back under its old name before its end is noticed.
            self._part.setsockopt(zmq.ROUTER_HANDOVER, 1)
            if keys is not None:
                keys.secure(self._part)
            held = MOST_CONNECTIONS, _SILENT_S, CONTROL_UNSENT_BYTES
            self._ports = Gates([Gate(self._context, self._part, *held, bytes_per_s, (1 << 16) + 2 * limit_bytes)])
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
        now_s = self._clock.now()
        if (second := int(now_s)) != self._second:
            self._second = second
            self._counted.clear()
            self._heard_before, self._heard = self._heard, {}
        self.crowded += self._ports.update(now_s)
        received = []
        for name, *frames in self._inbox.read():
            if not self._admits(name.bytes, frames[-1] if frames else name):
                continue
            if len(frames) == 1:
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

    def news(self) -> list[str]:
        """Return a line for each unknown key that was newly refused since the last call."""
        return [] if self._authenticator is None else self._authenticator.news()

    def wait(self, timeout_s: float) -> float:
        """Wait for a message, at most `timeout_s`; return the time on our monotonic clock."""
        self.wait_for(timeout_s, [self._inbox], self._authenticator)
        return self._clock.now()

    def cut_off(self, now_s: float) -> tuple[int, str]:
        """End connections beyond their budget of bytes; return the heaviest one's bytes since the last call, and its
        address."""
        self.crowded += self._ports.update(now_s)
        size, descriptor, _ = self._ports.cut_off(now_s)
        return size, peer_address(descriptor)

    def present(self) -> dict[bytes, tuple[str, str]]:
        """Return key and address of the peers that were heard lately, keyed by their names."""
        heard = self._heard_before | self._heard
        return {name: (key, peer_address(descriptor)) for name, (key, descriptor) in heard.items()}

    def take_flooding(self) -> set[str]:
        """Return the keys that were cut off because of PEER_LIMIT_PER_S since the last call."""
        flooding, self._flooding = self._flooding, set()
        return flooding

    def _admits(self, name: bytes, frame: zmq.Frame) -> bool:
        """Return whether a message's key is allowed and sends no more than it may; otherwise end the connection."""
        key = "" if self._keys is None else user_of(frame)
        descriptor = descriptor_of(frame)
        self._counted[key or name] += 1
        revoked = self._keys is not None and not self._keys.allowed.admits(key, (self._role,))
        if not revoked and self._counted[key or name] <= PEER_LIMIT_PER_S:
            self._ports.gates[0].connections.introduced(descriptor)
            self._heard[name] = key, descriptor
            return True
        self.revoked += revoked
        self.flooding += not revoked
        if key and not revoked:
            self._flooding.add(key)
        self.crowded += self._ports.update(self._clock.now())
        if self._ports.all_seen and self._ports.gates[0].connections.number(descriptor):
            shut_down(descriptor)
        return False
