"""Operations on ZeroMQ's connections by descriptor: ZeroMQ has no option or call for them."""

import contextlib
import socket
from collections.abc import Callable


def shut_down(descriptor: int) -> None:
    """End a connection; ZeroMQ notices and closes it."""
    _with(descriptor, lambda connection: connection.shutdown(socket.SHUT_RDWR))


def hold_little(descriptor: int, unsent_bytes: int) -> None:
    """Limit the unsent bytes in the kernel's buffer (TCP_NOTSENT_LOWAT).

    That bounds queueing there without bounding the bytes under way, as a small send buffer would.
    """
    _with(descriptor, lambda each: each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, unsent_bytes))


def _with(descriptor: int, act: Callable[[socket.socket], None]) -> None:
    """Act without another descriptor, as none may be left; the connection may end at any moment."""
    with contextlib.suppress(OSError):
        connection = socket.socket(socket.AF_INET, socket.SOCK_STREAM, fileno=descriptor)
        try:
            act(connection)
        finally:
            connection.detach()
