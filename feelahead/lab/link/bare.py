"""End of a link with bare ZeroMQ sockets only: it shows how much waking up and Python cost by themselves."""

import math
import select
from collections.abc import Iterator

import zmq

from common.clock import MonotonicClock


class BareEnd:
    """ROUTER socket that binds a TCP port on loopback, or DEALER socket that connects to `address`."""

    def __init__(self, size_bytes: int, address: str | None = None) -> None:
        self.sent = 0
        self._payload = bytes(size_bytes)
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
        """Close the sockets."""
        self._context.destroy(linger=0)

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """Send every `period_s` from `start_s` on, and receive, until `end_s`; yield the time of each turn."""
        clock, due_s = MonotonicClock(), start_s
        while (now_s := clock.now()) < end_s:
            yield now_s
            if now_s >= due_s:
                self.sent += self._send()
                # A late end catches up on nothing, as the sides do.
                due_s += period_s * max(1, math.floor((now_s - due_s) / period_s))
            if not self._readable():
                select.select([self._descriptor], [], [], max(0.0, due_s - clock.now()))
            self._receive()
        yield now_s

    def _receive(self) -> None:
        while self._readable():
            if self._routes:
                self._peer = self._socket.recv(zmq.NOBLOCK)
            self._socket.recv(zmq.NOBLOCK)

    def _send(self) -> bool:
        """Send without waiting; return False if the socket cannot take the message or no peer is known yet."""
        try:
            if self._routes:
                if self._peer is None:
                    return False
                self._socket.send(self._peer, zmq.NOBLOCK | zmq.SNDMORE)
            self._socket.send(self._payload, zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True

    def _readable(self) -> bool:
        # The descriptor signals changes only, and a send may have consumed one.
        return bool(int(self._socket.getsockopt(zmq.EVENTS)) & int(zmq.POLLIN))
