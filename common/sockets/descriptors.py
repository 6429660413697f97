"""Operations on ZeroMQ's TCP connections for which ZeroMQ has no call; they use the connection's descriptor."""

import contextlib
import socket
from collections.abc import Callable


def shut_down(descriptor: int) -> None:
    """End a TCP connection; ZeroMQ then notices the end and closes the descriptor."""
    _with(descriptor, lambda connection: connection.shutdown(socket.SHUT_RDWR))


def hold_little(descriptor: int, unsent_bytes: int) -> None:
    """Limit the unsent bytes of a connection in the kernel's buffer (TCP_NOTSENT_LOWAT).

    That bounds the queue in the kernel. A small send buffer would bound the bytes under way as well.
    """
    _with(descriptor, lambda each: each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, unsent_bytes))


def _with(descriptor: int, act: Callable[[socket.socket], None]) -> None:
    """Call `act` on the connection without opening another descriptor, as none may be left. Ignores OSError.

    An error means that the connection has ended, which may happen at any time.
    """
    with contextlib.suppress(OSError):
        connection = socket.socket(socket.AF_INET, socket.SOCK_STREAM, fileno=descriptor)
        try:
            act(connection)
        finally:
            connection.detach()
