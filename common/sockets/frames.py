"""The sender of a frame, told by ZeroMQ and not by the sender."""

from typing import Final

import zmq

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
