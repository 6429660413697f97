"""What ZeroMQ tells thousands of times a second: whether a socket has something, and who sent a frame."""

from typing import Final

import zmq

# Plain numbers: pyzmq takes longer to look up one of its own than ZeroMQ to answer.
EVENTS: Final = int(zmq.EVENTS)
_POLLIN: Final = int(zmq.POLLIN)


def readable(part: "zmq.Socket[bytes]") -> bool:
    """Whether something can be received from it at once; it takes note of whatever else has happened to it, too."""
    return int(part.getsockopt(EVENTS)) & _POLLIN != 0


_SOURCE: Final = int(zmq.SRCFD)


def user_of(frame: zmq.Frame) -> str:
    """The key that the connection authenticated with; empty where ZeroMQ knows none."""
    try:
        return str(frame.get("User-Id"))
    except zmq.ZMQError:
        return ""


def descriptor_of(frame: zmq.Frame) -> int:
    """The descriptor of the connection; -1 where ZeroMQ knows none."""
    try:
        return int(frame.get(_SOURCE))
    except zmq.ZMQError:
        return -1
