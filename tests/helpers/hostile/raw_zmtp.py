"""ZMTP 3.0 by hand over a plain TCP connection (rfc.zeromq.org/spec/23), so that errors can be sent."""

import contextlib
import socket
import struct

from common.sockets.greeting import KNOCK

GREETING = KNOCK + b"NULL".ljust(20, b"\0") + bytes(32)
"""Greeting of 64 bytes: mechanism NULL, not a server, filler."""
_MORE, _LONG, _COMMAND = 1, 2, 4
_TIMEOUT_S = 5.0


def ready(socket_type: bytes, name: bytes = b"") -> bytes:
    """Return the command that ends the handshake of the NULL mechanism; `name` is the routing id, empty for any."""
    body = b"\x05READY"
    for field, value in ((b"Socket-Type", socket_type), (b"Identity", name)):
        body += bytes([len(field)]) + field + struct.pack(">I", len(value)) + value
    return bytes([_COMMAND, len(body)]) + body


def frame(body: bytes, *, more: bool = False, claimed_bytes: int | None = None) -> bytes:
    """Return one frame of a message; `claimed_bytes` is a false length."""
    length = len(body) if claimed_bytes is None else claimed_bytes
    flags = _MORE if more else 0
    if length < 256:
        return bytes([flags, length]) + body
    return bytes([flags | _LONG]) + struct.pack(">Q", length) + body


def message(*bodies: bytes) -> bytes:
    """Return one message of these frames."""
    return b"".join(frame(body, more=position < len(bodies) - 1) for position, body in enumerate(bodies))


def port_of(endpoint: str) -> int:
    """Return the port of tcp://HOST:PORT."""
    return int(endpoint.rsplit(":", 1)[1])


class RawConnection:
    """TCP connection to a port of this machine that never blocks for long, and that the other side may end."""

    def __init__(self, port: int, sends: bytes = b"", buffer_bytes: int | None = None) -> None:
        """buffer_bytes: limit of the kernel's receive buffer, for a peer that does not read."""
        self.open = True
        """False once the other side has ended it."""
        self._socket = socket.socket()
        if buffer_bytes is not None:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_bytes)
        self._socket.settimeout(_TIMEOUT_S)
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
        """Send all of `content`, unless the other side has ended the connection or does not read."""
        if not self.open:
            return
        try:
            self._socket.sendall(content)
            self._read_away()
        except OSError:
            self.close()

    def read_all(self, silence_s: float = 0.3) -> bytes:
        """Return all bytes until a silence of `silence_s`."""
        self._socket.settimeout(silence_s)
        received = b""
        with contextlib.suppress(TimeoutError):
            while content := self._socket.recv(65536):
                received += content
        return received

    def ended(self) -> bool:
        """Return whether the other side has ended the connection; waits up to a few seconds."""
        if not self.open:
            return True
        self._socket.settimeout(_TIMEOUT_S)
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
        """Read until `expected` has come: a message before the other side's half of the handshake would end it."""
        received = b""
        while self.open and expected not in received:
            content = self._socket.recv(65536)
            if not content:
                self.close()
            received += content

    def _read_away(self) -> None:
        """Discard answers, so that they do not fill the buffers; close at the end of the stream."""
        self._socket.settimeout(0.0)
        try:
            while content := self._socket.recv(65536):
                del content
            self.close()
        except BlockingIOError:
            self._socket.settimeout(_TIMEOUT_S)
