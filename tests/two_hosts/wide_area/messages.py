"""Messages over one ZeroMQ connection at a constant rate: `receive`, or `send HZ SECONDS`, each in its host."""

import math
import struct
import sys
import time
from typing import Final

import msgspec
import numpy as np
import zmq

from common.realtime.priority import raise_priority
from tests.two_hosts.wide_area.forwarder import ADDRESSES

PAYLOAD_BYTES: Final = 156
WARM_UP_S: Final = 3.0
"""Time in seconds whose messages do not count: TCP opens its window with them."""
_ENDPOINT: Final = f"tcp://{ADDRESSES['operator']}:5555"
_STAMP: Final = struct.Struct("<d?")
"""Time of sending by the machine's shared clock, and whether the message counts."""
_SETTLES_S: Final = 1.0


def receive() -> None:
    """Receive until the standard input ends; then print the ages in ms, and the number of messages."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    socket = context.socket(zmq.ROUTER)
    socket.setsockopt(zmq.RCVHWM, 0)
    socket.bind(_ENDPOINT)
    poller = zmq.Poller()
    poller.register(socket, zmq.POLLIN)
    poller.register(sys.stdin.fileno(), zmq.POLLIN)
    _say({})
    ages_s: list[float] = []
    while sys.stdin.fileno() not in (ready := dict(poller.poll())):
        if socket in ready:
            sent_s, counts = _STAMP.unpack_from(socket.recv_multipart()[-1])
            if counts:
                ages_s.append(time.monotonic() - sent_s)
    context.destroy(linger=0)
    _say(ages(np.array(ages_s)))


def ages(delays_s: np.ndarray[tuple[int], np.dtype[np.float64]]) -> dict[str, float]:
    """Return `mean_ms`, `p50_ms`, `p95_ms`, `p99_ms` and `arrived` of (n,) delays in seconds."""
    of_ms = 1e3 * delays_s if delays_s.size else np.array([math.nan])
    p50, p95, p99 = np.quantile(of_ms, (0.5, 0.95, 0.99))
    found = {"mean_ms": of_ms.mean(), "p50_ms": p50, "p95_ms": p95, "p99_ms": p99, "arrived": delays_s.size}
    return {name: float(value) for name, value in found.items()}


def send(hz: float, seconds: float) -> None:
    """Send at `hz`, then wait until the standard input ends; nothing is delayed or dropped here."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    socket = context.socket(zmq.DEALER)
    socket.setsockopt(zmq.SNDHWM, 0)
    socket.connect(_ENDPOINT)
    start_s = time.monotonic() + _SETTLES_S
    padding = bytes(PAYLOAD_BYTES - _STAMP.size)
    for number in range(int(hz * (WARM_UP_S + seconds))):
        time.sleep(max(0.0, start_s + number / hz - time.monotonic()))
        socket.send(_STAMP.pack(time.monotonic(), number >= hz * WARM_UP_S) + padding, zmq.NOBLOCK)
    _say({})
    sys.stdin.read()
    context.destroy(linger=0)


def _say(what: dict[str, float]) -> None:
    sys.stdout.write(msgspec.json.encode(what).decode() + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    raise_priority()
    if sys.argv[1] == "receive":
        receive()
    else:
        send(float(sys.argv[2]), float(sys.argv[3]))
