"""Connections that ZeroMQ owns, reached by their descriptors: ZeroMQ has no option or call for this."""

import contextlib
import socket
from collections.abc import Callable


def shut_down(descriptor: int) -> None:
    """End a connection; ZeroMQ notices and closes it."""
    _with(descriptor, lambda connection: connection.shutdown(socket.SHUT_RDWR))


def hold_little(descriptor: int, unsent_bytes: int) -> None:
    """Let the kernel take no more than `unsent_bytes` ahead of what the network takes (TCP_NOTSENT_LOWAT).

    That bounds what grows old there without bounding what is under way, as a small send buffer would.
    """
    _with(descriptor, lambda each: each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, unsent_bytes))


def _with(descriptor: int, act: Callable[[socket.socket], None]) -> None:
    """Act without a descriptor more, as there may be none left; the connection may go at any moment."""
    with contextlib.suppress(OSError):
        connection = socket.socket(socket.AF_INET, socket.SOCK_STREAM, fileno=descriptor)
        try:
            act(connection)
        finally:
            connection.detach()
