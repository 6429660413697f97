"""A TCP relay on loopback that can be cut like a cable: both ends still think that they are connected."""

import multiprocessing
import os
import signal
import socket
import threading
from types import TracebackType
from typing import Self

_PIECE_BYTES = 65536


class Cable:
    """Forwards every connection to 127.0.0.1:`port` in a process of its own, which stands still while it is cut."""

    def __init__(self, port: int) -> None:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            self.port = int(listener.getsockname()[1])
            """The port to connect to instead"""
            context = multiprocessing.get_context("spawn")
            self._process = context.Process(target=_forward, args=(listener, port), daemon=True)
            self._process.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.join()

    def cut(self) -> None:
        """Let nothing through any more, either way; no connection is closed."""
        os.kill(self._process.pid or 0, signal.SIGSTOP)

    def mend(self) -> None:
        """Go on; what the kernel's buffers held back comes first."""
        os.kill(self._process.pid or 0, signal.SIGCONT)


def _forward(listener: socket.socket, port: int) -> None:
    while True:
        near, _ = listener.accept()
        try:
            far = socket.create_connection(("127.0.0.1", port), timeout=1.0)
        except OSError:
            near.close()
            continue
        far.settimeout(None)
        for one, other in ((near, far), (far, near)):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=_pass_on, args=(one, other), daemon=True).start()


def _pass_on(one: socket.socket, other: socket.socket) -> None:
    try:
        while piece := one.recv(_PIECE_BYTES):
            other.sendall(piece)
    except OSError:
        pass
    for end in (one, other):
        end.close()
