"""Sockets reduced to what a measurement needs: bare UDP, bare ZeroMQ, and the robot side's.

Bare ones show what waking and Python cost by themselves, and what ZeroMQ's own threads add to it.
"""

import select
import socket
from typing import Protocol

import zmq

from common.sockets.robot import RobotSockets


class Link(Protocol):
    """One end's sockets, reduced to what a measurement needs."""

    def receive(self) -> list[bytes]:
        """Take everything that has arrived, oldest first."""
        ...

    def send(self, payload: bytes) -> bool:
        """Send at once; False when that cannot be done, or the peer is unknown."""
        ...

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive; say whether it has."""
        ...


class DatagramLink:
    """A UDP socket on loopback that talks to `address`, or to the peer that spoke last."""

    def __init__(self, address: tuple[str, int] | None = None) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        self._peer = address
        self.address = self._socket.getsockname()
        self.close = self._socket.close

    def receive(self) -> list[bytes]:
        """Take everything that has arrived, oldest first."""
        received: list[bytes] = []
        while True:
            try:
                payload, self._peer = self._socket.recvfrom(65536)
            except (BlockingIOError, ConnectionRefusedError):
                return received
            received.append(payload)

    def send(self, payload: bytes) -> bool:
        """Send at once; False when that cannot be done, or the peer is unknown."""
        try:
            return self._peer is not None and self._socket.sendto(payload, self._peer) > 0
        except (BlockingIOError, ConnectionRefusedError):
            return False

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive; say whether it has."""
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
        self._descriptor = self._socket.fileno()
        self._routes = address is None
        self._peer: bytes | None = None

    def close(self) -> None:
        """Hang up."""
        self._context.destroy(linger=0)

    def receive(self) -> list[bytes]:
        """Take everything that has arrived, oldest first."""
        received: list[bytes] = []
        while self._readable():
            if self._routes:
                self._peer = self._socket.recv(zmq.NOBLOCK)
            received.append(self._socket.recv(zmq.NOBLOCK))
        return received

    def send(self, payload: bytes) -> bool:
        """Send at once; False when that cannot be done, or the peer is unknown."""
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
        """Wait for something to arrive; say whether it has."""
        if not self._readable():
            select.select([self._descriptor], [], [], timeout_s)
        return self._readable()

    def _readable(self) -> bool:
        # The descriptor tells of changes only, and a send may have taken notice of one.
        return bool(int(self._socket.getsockopt(zmq.EVENTS)) & int(zmq.POLLIN))


class RobotLink:
    """The robot side's sockets, talking to the peer that spoke last."""

    def __init__(self, sockets: RobotSockets) -> None:
        self._sockets, self._peer = sockets, b""
        self.wait = sockets.wait

    def receive(self) -> list[bytes]:
        """Take everything that has arrived, oldest first."""
        received = self._sockets.receive()
        if received:
            self._peer = received[-1][0]
        return [payload for _, payload in received]

    def send(self, payload: bytes) -> bool:
        """Send at once; False when that cannot be done."""
        return self._sockets.send(self._peer, payload)
