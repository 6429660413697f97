"""Bulk transfer over TCP that competes with both sides, like an upload. The argument is `receive` or `send`."""

import select
import socket
import sys
import time
from typing import Final

from tests.two_hosts.wide_area.forwarder import ADDRESSES

_ADDRESS: Final = (ADDRESSES["operator"], 6000)
_BLOCK: Final = 1 << 16
_LOOKS_S: Final = 0.2


def receive() -> None:
    """Receive from one sender until the standard input ends; then print the number of bytes."""
    with socket.create_server(_ADDRESS) as server:
        sys.stdout.write("{}\n")
        sys.stdout.flush()
        sender, _ = server.accept()
    count = 0
    with sender:
        while sys.stdin not in select.select([sender, sys.stdin], [], [])[0]:
            count += len(sender.recv(_BLOCK))
    sys.stdout.write(f'{{"bytes": {count}}}\n')


def send() -> None:
    """Send zeros until the standard input ends, as fast as TCP accepts them."""
    deadline_s = time.monotonic() + 3600.0
    with socket.create_connection(_ADDRESS) as receiver:
        receiver.setblocking(False)
        while time.monotonic() < deadline_s:
            readable, writable, _ = select.select([sys.stdin], [receiver], [], _LOOKS_S)
            if readable:
                return
            if writable:
                receiver.send(bytes(_BLOCK))


if __name__ == "__main__":
    {"receive": receive, "send": send}[sys.argv[1]]()
