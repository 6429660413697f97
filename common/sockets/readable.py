"""Whether a socket has something, asked thousands of times a second."""

from typing import Final

import zmq

# Plain numbers: pyzmq takes longer to look up one of its own than ZeroMQ to answer.
EVENTS: Final = int(zmq.EVENTS)
_POLLIN: Final = int(zmq.POLLIN)


def readable(part: "zmq.Socket[bytes]") -> bool:
    """Whether something can be received from it at once; it takes note of whatever else has happened to it, too."""
    return int(part.getsockopt(EVENTS)) & _POLLIN != 0
