"""Messages sent through the router, one each millisecond, and recorded: as UDP datagrams, or over ZeroMQ and TCP."""

import socket
import struct
import threading
import time

import zmq

from tests.netem.cases import PAYLOAD_BYTES, PERIOD_NS
from tests.netem.namespaces import RECEIVER, enter

Recording = list[tuple[int, int | None]]
"""Time of sending and time of arrival of each message, in nanoseconds; arrival None: lost"""

_PORT = 5555
_SO_TIMESTAMPNS = 35
_SO_RCVBUFFORCE = 33
_BUFFER_BYTES = 64 << 20
_NUMBER = struct.Struct("<q")
_STAMP = struct.Struct("<qq")
_PADDING = bytes(PAYLOAD_BYTES - _NUMBER.size)
_WARM_UP = 1000
"""Number of messages at the start of a stream that are left out, as TCP still opens its window"""
_LAST_MS = 5000


def exchange_datagrams(count: int) -> Recording:
    """Send `count` UDP datagrams one way. The kernel stamps arrivals, so that no process need wake for them."""
    enter("receiver")
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind((RECEIVER, _PORT))
    receiver.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _BUFFER_BYTES)
    receiver.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
    receiver.settimeout(0.5)
    enter("sender")
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.connect((RECEIVER, _PORT))
    sent_ns: list[int] = []
    arrived_ns: dict[int, int] = {}
    with receiver, sender:
        start_ns = time.time_ns() + PERIOD_NS
        for number in range(count):
            left_ns = start_ns + number * PERIOD_NS - time.time_ns()
            if left_ns > 0:
                time.sleep(1e-9 * left_ns)
            payload = _NUMBER.pack(number) + _PADDING
            sent_ns.append(time.time_ns())
            sender.send(payload)
        while True:
            try:
                payload, extra, _, _ = receiver.recvmsg(2 * PAYLOAD_BYTES, 128)
            except TimeoutError:
                break
            seconds, nanoseconds = _STAMP.unpack(extra[0][2])
            arrived_ns[_NUMBER.unpack_from(payload)[0]] = seconds * 1_000_000_000 + nanoseconds
    return [(stamp_ns, arrived_ns.get(number)) for number, stamp_ns in enumerate(sent_ns)]


def exchange_stream(count: int) -> Recording:
    """Send `count` messages from a DEALER to a ROUTER socket over TCP; its acknowledgements pass netem, too."""
    enter("receiver")
    there: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    router = _unbounded(there.socket(zmq.ROUTER))
    router.bind(f"tcp://{RECEIVER}:{_PORT}")
    enter("sender")
    here: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    dealer = _unbounded(here.socket(zmq.DEALER))
    dealer.connect(f"tcp://{RECEIVER}:{_PORT}")
    total = _WARM_UP + count
    arrived_ns: list[int | None] = []

    def receive() -> None:
        router.setsockopt(zmq.RCVTIMEO, _LAST_MS)
        while len(arrived_ns) < total:
            router.recv_multipart(copy=False)
            arrived_ns.append(time.monotonic_ns())

    thread = threading.Thread(target=receive)
    thread.start()
    sent_ns: list[int] = []
    start_ns = time.monotonic_ns() + 500_000_000
    payload = bytes(PAYLOAD_BYTES)
    for number in range(total):
        left_ns = start_ns + number * PERIOD_NS - time.monotonic_ns()
        if left_ns > 0:
            time.sleep(1e-9 * left_ns)
        sent_ns.append(time.monotonic_ns())
        dealer.send(payload, zmq.NOBLOCK)
    thread.join()
    for context in (here, there):
        context.destroy(linger=0)
    # In order and complete, as a stream is.
    return list(zip(sent_ns, arrived_ns, strict=True))[_WARM_UP:]


def _unbounded(made: "zmq.Socket[bytes]") -> "zmq.Socket[bytes]":
    made.setsockopt(zmq.SNDHWM, 0)
    made.setsockopt(zmq.RCVHWM, 0)
    return made
