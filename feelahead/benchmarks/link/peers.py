"""Sockets reduced to what a measurement needs: the robot side's, bare ZeroMQ ones and bare UDP.

The bare ones show what waking and Python cost by themselves, and what ZeroMQ's own threads add to it.
"""

import select
import socket
from types import TracebackType
from typing import Protocol, Self

import zmq

from common.sockets.robot import RobotSockets

_LARGEST_BYTES = 65536
_EVENTS, _POLLIN = int(zmq.EVENTS), int(zmq.POLLIN)


class Link(Protocol):
    """One end's sockets, reduced to what a measurement needs."""

    def receive(self) -> list[bytes]:
        """Everything that has arrived."""
        ...

    def send(self, payload: bytes) -> bool:
        """Send to the other end; whether that could be done at once."""
        ...

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive; whether it has."""
        ...


class DatagramLink:
    """A UDP socket on loopback that talks to whoever spoke to it last, or to `address`."""

    def __init__(self, address: tuple[str, int] | None = None) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        self._peer = address

    @property
    def address(self) -> tuple[str, int]:
        """Where to reach this end."""
        host, port = self._socket.getsockname()
        return str(host), int(port)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()

    def receive(self) -> list[bytes]:
        """Everything that has arrived, oldest first."""
        received: list[bytes] = []
        while True:
            try:
                payload, self._peer = self._socket.recvfrom(_LARGEST_BYTES)
            except (BlockingIOError, ConnectionRefusedError):
                return received
            received.append(payload)

    def send(self, payload: bytes) -> bool:
        """Send to the other end; False when nobody is known there, or the system's buffer is full."""
        if self._peer is None:
            return False
        try:
            self._socket.sendto(payload, self._peer)
        except (BlockingIOError, ConnectionRefusedError):
            return False
        return True

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive; whether it has."""
        return bool(select.select([self._socket], [], [], timeout_s)[0])


class BareZeroMQLink:
    """A ROUTER that binds over TCP on loopback, or a DEALER that connects to `address`, with nothing around it."""

    def __init__(self, address: str | None = None) -> None:
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER if address is None else zmq.DEALER)
        self._socket.setsockopt(zmq.LINGER, 0)
        if address is None:
            self._socket.bind("tcp://127.0.0.1:*")
        else:
            self._socket.connect(address)
        self.address = self._socket.getsockopt_string(zmq.LAST_ENDPOINT)
        """Where to reach this end."""
        self._descriptor = self._socket.fileno()
        self._routes = address is None
        self._peer: bytes | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._context.destroy(linger=0)

    def receive(self) -> list[bytes]:
        """Everything that has arrived, oldest first."""
        received: list[bytes] = []
        while self._readable():
            if self._routes:
                self._peer = self._socket.recv(zmq.NOBLOCK)
            received.append(self._socket.recv(zmq.NOBLOCK))
        return received

    def send(self, payload: bytes) -> bool:
        """Send to the other end; False when nobody is known there, or it cannot be done at once."""
        try:
            if self._routes:
                if self._peer is None:
                    return False
                self._socket.send(self._peer, zmq.NOBLOCK | zmq.SNDMORE)
            self._socket.send(payload, zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive; whether it has."""
        if not self._readable():
            select.select([self._descriptor], [], [], timeout_s)
        return self._readable()

    def _readable(self) -> bool:
        # The descriptor tells of changes only, and a send may have taken notice of one.
        return bool(int(self._socket.getsockopt(_EVENTS)) & _POLLIN)


class RobotLink:
    """The robot side's sockets as the end of a link to whoever spoke last."""

    def __init__(self, sockets: RobotSockets) -> None:
        self._sockets = sockets
        self._peer = b""

    def receive(self) -> list[bytes]:
        """Everything that has arrived, oldest first."""
        received = self._sockets.receive()
        if received:
            self._peer = received[-1][0]
        return [payload for _, payload in received]

    def send(self, payload: bytes) -> bool:
        """Send to the other end; whether that could be done at once."""
        return self._sockets.send(self._peer, payload)

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive; whether it has."""
        return self._sockets.wait(timeout_s)
