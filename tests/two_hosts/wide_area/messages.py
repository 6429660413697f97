"""Programs that send messages over one ZeroMQ connection at a constant rate: `send HZ SECONDS` and `receive`."""

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
"""Seconds at the start whose messages are left out, as TCP still opens its window"""
_ENDPOINT: Final = f"tcp://{ADDRESSES['operator']}:5555"
_STAMP: Final = struct.Struct("<d?")
"""Time of sending, by the clock that both hosts share, and whether the message counts"""


def receive() -> None:
    """Receive until the standard input ends; then print quantiles of the messages' ages, and their number."""
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
    """Return mean and quantiles of the delays (n,), in milliseconds, and their number as `arrived`."""
    of_ms = 1e3 * delays_s if delays_s.size else np.array([math.nan])
    p50, p95, p99 = np.quantile(of_ms, (0.5, 0.95, 0.99))
    found = {"mean_ms": of_ms.mean(), "p50_ms": p50, "p95_ms": p95, "p99_ms": p99, "arrived": delays_s.size}
    return {name: float(value) for name, value in found.items()}


def send(hz: float, seconds: float) -> None:
    """Send `hz` messages a second for `seconds` after a warm-up, then wait until the standard input ends.

    The socket has no high-water mark: it drops no message.
    """
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    socket = context.socket(zmq.DEALER)
    socket.setsockopt(zmq.SNDHWM, 0)
    socket.connect(_ENDPOINT)
    start_s = time.monotonic() + 1.0
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
