"""Channel of messages between two processes on one machine, over a stream socket; neither process waits for the other.

A message is sent as its length and its bytes. A message that does not fit into the bounded send queue is dropped.
"""

import contextlib
import socket
import struct
from collections import deque
from typing import Final

_LENGTH: Final = struct.Struct("<I")
_AT_ONCE: Final = 1 << 18
MESSAGE_LIMIT_BYTES: Final = 1 << 26
"""Longest message, in bytes; a longer one means that the sender is no process of ours."""


class Channel:
    """One end of a channel. To wait for it, select `fileno` for reading, and for writing while `waiting` is above 0."""

    def __init__(self, part: socket.socket, room_bytes: int = 1 << 23) -> None:
        """`part`: a connected stream socket. `room_bytes`: capacity of the send queue, besides the system's buffer."""
        part.setblocking(False)
        for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
            part.setsockopt(socket.SOL_SOCKET, option, _AT_ONCE)
        self.ended = False
        """Whether either end is closed, so that no more messages can be sent or arrive."""
        self._part = part
        self._room_bytes = room_bytes
        self._waiting: deque[memoryview] = deque()
        self.waiting = 0
        """Number of bytes in the send queue."""
        self._begun = bytearray()

    def fileno(self) -> int:
        """Return the socket's descriptor."""
        return self._part.fileno()

    def send(self, *parts: bytes) -> bool:
        """Send `parts` as one message, now or in a later call. Return False, and drop it, if there is no room."""
        self.flush()
        length = sum(map(len, parts))
        if length > MESSAGE_LIMIT_BYTES:
            raise ValueError(f"the message has {length} bytes; valid: up to {MESSAGE_LIMIT_BYTES}")
        if self.ended or (self._waiting and self.waiting + length > self._room_bytes):
            return False
        for part in (_LENGTH.pack(length), *parts):
            if part:
                self._waiting.append(memoryview(part))
                self.waiting += len(part)
        self.flush()
        return True

    def flush(self) -> None:
        """Send as much of the queue as the socket takes now."""
        waiting = self._waiting
        while waiting and not self.ended:
            try:
                sent = self._part.sendmsg(list(waiting)[:16])
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                # The other end is closed. What it had sent before still counts.
                while self._read():
                    pass
                self._end()
                return
            self.waiting -= sent
            while sent:
                first = waiting.popleft()
                if len(first) > sent:
                    waiting.appendleft(first[sent:])
                    break
                sent -= len(first)

    def receive(self) -> list[bytes]:
        """Return the messages that have arrived completely, oldest first.

        Reads the system's buffer once, so that a fast sender cannot block the caller.
        """
        self.flush()
        self._read()
        whole, start = [], 0
        while len(self._begun) - start >= _LENGTH.size:
            (length,) = _LENGTH.unpack_from(self._begun, start)
            if length > MESSAGE_LIMIT_BYTES:
                self._end()
                break
            end = start + _LENGTH.size + length
            if len(self._begun) < end:
                break
            whole.append(bytes(self._begun[start + _LENGTH.size : end]))
            start = end
        del self._begun[:start]
        return whole

    def _read(self) -> bool:
        """Read the system's buffer once; return whether anything was there."""
        try:
            arrived = self._part.recv(_AT_ONCE)
        except (BlockingIOError, InterruptedError):
            return False
        except OSError:
            arrived = b""
        if not arrived:
            self._end()
        self._begun += arrived
        return bool(arrived)

    def _end(self) -> None:
        self.ended = True
        self._waiting.clear()
        self.waiting = 0

    def close(self) -> None:
        """Close this end; at the other end `ended` becomes true."""
        self._end()
        with contextlib.suppress(OSError):
            self._part.close()
