"""Fast queries to ZeroMQ: whether a socket has a message, and who sent a frame."""

from typing import Final

import zmq

# Plain numbers: pyzmq's look-up of an enum takes longer than ZeroMQ's answer.
EVENTS: Final = int(zmq.EVENTS)
_POLLIN: Final = int(zmq.POLLIN)


def readable(part: "zmq.Socket[bytes]") -> bool:
    """Return whether a frame can be received at once; ZeroMQ also processes the socket's pending events."""
    return int(part.getsockopt(EVENTS)) & _POLLIN != 0


_SOURCE: Final = int(zmq.SRCFD)


def user_of(frame: zmq.Frame) -> str:
    """Return the key with which the frame's connection authenticated; empty if ZeroMQ knows none."""
    try:
        return str(frame.get("User-Id"))
    except zmq.ZMQError:
        return ""


def descriptor_of(frame: zmq.Frame) -> int:
    """Return the descriptor of the frame's connection; -1 if ZeroMQ knows none."""
    try:
        return int(frame.get(_SOURCE))
    except zmq.ZMQError:
        return -1
