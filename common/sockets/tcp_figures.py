"""The kernel's figures of TCP connections: packets sent, packets sent again, and round trip."""

import contextlib
import socket
import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final, NamedTuple, Self

_BYTES: Final = 160
_ROUND_TRIP, _SENT_AGAIN, _RECEIVED, _SENT = 68, 100, 128, 156
"""Offsets in the kernel's `struct tcp_info`: tcpi_rtt in microseconds, tcpi_total_retrans, tcpi_bytes_received,
tcpi_data_segs_out."""


class TcpFigures(NamedTuple):
    """Numbers of packets with data that one or more connections have sent since they began."""

    sent: int = 0
    sent_again: int = 0
    """Number of retransmitted packets; `sent` includes them."""
    round_trip_s: float | None = None
    """Least of the connections' round trips, which the kernel smooths; None if there is none."""

    def since(self, before: Self) -> "TcpFigures":
        """Return the packets sent since the earlier figures `before`, with the present round trip."""
        sent, again = self.sent - before.sent, self.sent_again - before.sent_again
        return TcpFigures(max(sent, 0), max(again, 0), self.round_trip_s)

    @property
    def lost_share(self) -> float | None:
        """Share of packets that were sent again, 0 to 1; None if none was sent."""
        return self.sent_again / self.sent if self.sent else None


def tcp_figures(descriptors: Collection[int]) -> TcpFigures:
    """Add up the figures of the connections with these `descriptors`; ended connections are left out."""
    sent = again = 0
    trips_s = []
    for descriptor in descriptors:
        with contextlib.suppress(OSError), _borrowed(descriptor) as connection:
            info = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _BYTES)
            if len(info) == _BYTES:
                again += struct.unpack_from("I", info, _SENT_AGAIN)[0]
                sent += struct.unpack_from("I", info, _SENT)[0]
                trips_s.append(1e-6 * struct.unpack_from("I", info, _ROUND_TRIP)[0])
    return TcpFigures(sent, again, min((trip_s for trip_s in trips_s if trip_s > 0.0), default=None))


def received_bytes(descriptor: int) -> int:
    """Return how many bytes a connection has received since it began; 0 if it has ended."""
    with contextlib.suppress(OSError), _borrowed(descriptor) as connection:
        info = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _BYTES)
        if len(info) == _BYTES:
            return int(struct.unpack_from("Q", info, _RECEIVED)[0])
    return 0


def peer_address(descriptor: int) -> str:
    """Return host and port of a connection's other end; empty if there is none."""
    with contextlib.suppress(OSError, ValueError), _borrowed(descriptor) as connection:
        host, port = connection.getpeername()[:2]
        return f"{host}:{port}"
    return ""


def connected_to(port: int) -> list[int]:
    """Find the descriptors of this process's TCP connections to `port` at the peer; ZeroMQ does not report them."""
    found = []
    for name in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError):
            if name.is_socket():
                descriptor = int(name.name)
                with _borrowed(descriptor) as connection:
                    place = connection.getpeername()
                    if isinstance(place, tuple) and place[1] == port:
                        found.append(descriptor)
    return found


@contextlib.contextmanager
def _borrowed(descriptor: int) -> Iterator[socket.socket]:
    connection = socket.socket(fileno=descriptor)
    try:
        yield connection
    finally:
        connection.detach()
