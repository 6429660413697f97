"""Stand-in for an evdev device node: events go over a socket pair, and ioctls of linux/input.h are answered here."""

import contextlib
import os
import socket
import struct
from typing import Any

EVENT = struct.Struct("=qqHHi")
PAD_KEYS = tuple(range(0x130, 0x13F))
RANGES = dict.fromkeys(range(6), (0, 255)) | {16: (-1, 1), 17: (-1, 1)}


def bits(*codes: int) -> bytes:
    return sum(1 << code for code in codes).to_bytes(96, "little")


class FakeNode:
    """Kernel's end of an evdev device node, with the layouts of a 64-bit machine."""

    def __init__(self, keys: tuple[int, ...] = PAD_KEYS, effects: tuple[int, ...] = (0x50,)) -> None:
        ours, self._theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        ours.setblocking(False)
        self._theirs.setblocking(False)
        self.descriptor = ours.detach()
        self.values = dict.fromkeys(range(4), 128) | {2: 0, 5: 0, 3: 128, 4: 128, 16: 0, 17: 0}
        self.down: set[int] = set()
        self.uploaded: list[tuple[int, int, int, int]] = []
        """Id, length in ms, strong and weak magnitude of each uploaded effect."""
        self._bits = {0x20: bits(0, 1, 3, 21), 0x21: bits(*keys), 0x23: bits(*RANGES), 0x35: bits(*effects)}

    def ioctl(self, descriptor: int, request: int, content: Any) -> int:
        assert descriptor == self.descriptor
        number, size = request & 0xFF, request >> 16 & 0x3FFF
        assert (request >> 8 & 0xFF, size) == (ord("E"), len(content))
        if number == 0x80:
            assert (request >> 30, size) == (1, 48)
            kind, known, _, _, _, length_ms, _, strong, weak = struct.unpack_from("=HhHHHHH2xHH", content)
            assert kind == 0x50
            number = 3 if known == -1 else known
            struct.pack_into("=h", content, 2, number)
            self.uploaded.append((number, length_ms, strong, weak))
            return 0
        assert request >> 30 == 2
        if number >= 0x40:
            axis = number - 0x40
            content[:] = struct.pack("=6i", self.values[axis], *RANGES[axis], 0, 0, 0)
        elif number == 0x06:
            content[:4] = b"Pad\0"
        elif number == 0x08:
            content[:18] = b"AA:BB:CC:00:00:01\0"
        else:
            content[:] = bits(*self.down) if number == 0x18 else self._bits[number]
        return 0

    def send(self, *events: tuple[int, int, int]) -> None:
        """Send events (kind, code, value), and then the event that ends a report."""
        self._theirs.sendall(b"".join(EVENT.pack(0, 0, *event) for event in (*events, (0, 0, 0))))

    def plays(self) -> list[tuple[int, int]]:
        """Return the effects (id, count) that were played since the last call."""
        try:
            content = self._theirs.recv(65536)
        except BlockingIOError:
            return []
        played = [EVENT.unpack_from(content, place)[2:] for place in range(0, len(content), EVENT.size)]
        assert all(kind == 21 for kind, _, _ in played)
        return [(code, value) for _, code, value in played]

    def unplug(self) -> None:
        self._theirs.close()

    def close(self) -> None:
        self._theirs.close()
        with contextlib.suppress(OSError):
            os.close(self.descriptor)
