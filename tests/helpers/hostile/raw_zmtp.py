"""ZMTP 3.0 (rfc.zeromq.org/spec/23) written on a plain TCP connection, so that tests can send invalid bytes."""

import contextlib
import socket
import struct

from common.sockets.greeting import KNOCK
from tests.helpers.machines.waiting import LIMIT_S

GREETING = KNOCK + b"NULL".ljust(20, b"\0") + bytes(32)
"""Greeting of 64 bytes: signature and version, mechanism NULL, then zeros: not a server, and filler."""
_MORE, _LONG, _COMMAND = 1, 2, 4


def ready(socket_type: bytes, name: bytes = b"") -> bytes:
    """Return the READY command, which ends the handshake of mechanism NULL.

    name: routing id; if empty, the other side chooses one.
    """
    body = b"\x05READY"
    for field, value in ((b"Socket-Type", socket_type), (b"Identity", name)):
        body += bytes([len(field)]) + field + struct.pack(">I", len(value)) + value
    return bytes([_COMMAND, len(body)]) + body


def frame(body: bytes, *, more: bool = False, claimed_bytes: int | None = None) -> bytes:
    """Encode one frame of a message; `claimed_bytes` replaces the true length of `body`."""
    length = len(body) if claimed_bytes is None else claimed_bytes
    flags = _MORE if more else 0
    if length < 256:
        return bytes([flags, length]) + body
    return bytes([flags | _LONG]) + struct.pack(">Q", length) + body


def message(*bodies: bytes) -> bytes:
    """Encode one message that consists of these frames."""
    return b"".join(frame(body, more=position < len(bodies) - 1) for position, body in enumerate(bodies))


def port_of(endpoint: str) -> int:
    """Return the port of tcp://HOST:PORT."""
    return int(endpoint.rsplit(":", 1)[1])


class RawConnection:
    """TCP connection to a port of this machine, with a time limit. The other side may end it at any time."""

    def __init__(self, port: int, sends: bytes = b"", buffer_bytes: int | None = None) -> None:
        """Connect and send `sends`. buffer_bytes: the kernel's receive buffer, small for a peer that does not read."""
        self.open = True
        """False once either side has closed the connection"""
        self._socket = socket.socket()
        if buffer_bytes is not None:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_bytes)
        self._socket.settimeout(LIMIT_S)
        self._socket.connect(("127.0.0.1", port))
        self._socket.sendall(sends)

    @classmethod
    def introduced(
        cls, port: int, socket_type: bytes = b"DEALER", buffer_bytes: int | None = None, name: bytes = b""
    ) -> "RawConnection":
        """Return a connection that has finished the handshake as a well-behaved peer; OSError if refused."""
        connection = cls(port, GREETING + ready(socket_type, name), buffer_bytes)
        connection._await(b"\x05READY")
        return connection

    def send(self, content: bytes) -> None:
        """Send all of `content`; close the connection if the other side has ended it or does not read."""
        if not self.open:
            return
        try:
            self._socket.sendall(content)
            self._read_away()
        except OSError:
            self.close()

    def read_all(self, silence_s: float = 0.3) -> bytes:
        """Return all received bytes, until none has come for `silence_s` or the other side ends the connection."""
        self._socket.settimeout(silence_s)
        received = b""
        with contextlib.suppress(TimeoutError):
            while content := self._socket.recv(65536):
                received += content
        return received

    def ended(self) -> bool:
        """Wait until the other side ends the connection, then return True; return False if nothing comes for long."""
        if not self.open:
            return True
        self._socket.settimeout(LIMIT_S)
        try:
            while self._socket.recv(65536):
                pass
        except TimeoutError:
            return False
        except OSError:
            pass
        self.close()
        return True

    def close(self) -> None:
        """Close the connection."""
        self.open = False
        self._socket.close()

    def _await(self, expected: bytes) -> None:
        """Read until `expected` has come.

        A message sent before the other side's half of the handshake would end the connection.
        """
        received = b""
        while self.open and expected not in received:
            content = self._socket.recv(65536)
            if not content:
                self.close()
            received += content

    def _read_away(self) -> None:
        """Discard received bytes, so that they do not fill the buffers; close if the other side has ended."""
        self._socket.settimeout(0.0)
        try:
            while content := self._socket.recv(65536):
                del content
            self.close()
        except BlockingIOError:
            self._socket.settimeout(LIMIT_S)
