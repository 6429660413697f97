"""A TCP relay on loopback that can be cut like a cable: both ends still think that they are connected."""

import contextlib
import selectors
import socket
import threading
from types import TracebackType
from typing import Self

_PIECE_BYTES = 65536
_POLL_S = 0.02


class Cable:
    """Forwards every connection to 127.0.0.1:`port`, until it is cut."""

    def __init__(self, port: int) -> None:
        self._target = ("127.0.0.1", port)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.setblocking(False)
        self._whole = threading.Event()
        self._whole.set()
        self._ends = threading.Event()
        self._pairs: dict[socket.socket, socket.socket] = {}
        self._thread = threading.Thread(target=self._forward, daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Where to connect instead."""
        return int(self._listener.getsockname()[1])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ends.set()
        self._thread.join(timeout=5.0)
        for end in (*self._pairs, self._listener):
            end.close()

    def cut(self) -> None:
        """Nothing gets through any more, either way; no connection is closed."""
        self._whole.clear()

    def mend(self) -> None:
        """What was held back in the kernel's buffers comes first."""
        self._whole.set()

    def _forward(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._listener, selectors.EVENT_READ)
            while not self._ends.is_set():
                if not self._whole.wait(_POLL_S):
                    continue
                for key, _ in selector.select(_POLL_S):
                    if not self._whole.is_set():
                        break
                    if key.fileobj is self._listener:
                        self._accept(selector)
                    elif isinstance(key.fileobj, socket.socket) and key.fileobj in self._pairs:
                        self._pass_on(selector, key.fileobj)

    def _accept(self, selector: selectors.BaseSelector) -> None:
        near, _ = self._listener.accept()
        try:
            far = socket.create_connection(self._target, timeout=1.0)
        except OSError:
            near.close()
            return
        for one, other in ((near, far), (far, near)):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._pairs[one] = other
            selector.register(one, selectors.EVENT_READ)

    def _pass_on(self, selector: selectors.BaseSelector, end: socket.socket) -> None:
        other = self._pairs[end]
        try:
            piece = end.recv(_PIECE_BYTES)
            if piece:
                other.sendall(piece)
                return
        except OSError:
            pass
        for one in (end, other):
            with contextlib.suppress(KeyError):
                selector.unregister(one)
            self._pairs.pop(one, None)
            one.close()
