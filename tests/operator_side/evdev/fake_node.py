"""Stand-in for an evdev device node: events go over a socket pair, and ioctls of linux/input.h are answered here.

The queue behaves as that of a reader in the kernel's drivers/input/evdev.c.
"""

import contextlib
import os
import socket
import struct
from collections.abc import Iterable, Mapping
from typing import Any

from operator_side.controller.state import ControllerState
from operator_side.evdev.pad import EvdevPad

EVENT = struct.Struct("=qqHHi")
PAD_KEYS = tuple(range(0x130, 0x13F))
KEY, ABS, FF = 1, 3, 21
REPORT, DROPPED = (0, 0, 0), (0, 3, 0)
Event = tuple[int, int, int]
HATS = {16: (-1, 1, 0), 17: (-1, 1, 0)}
AXES = {0: (0, 255, 128), 1: (0, 255, 128), 2: (0, 255, 0), 3: (0, 255, 128), 4: (0, 255, 128), 5: (0, 255, 0)} | HATS
"""Least, most and resting value of each axis of a DualSense, as hid-playstation gives them"""


def state_of(pad: EvdevPad, now_s: float = 0.0) -> ControllerState:
    state = pad.read(now_s)
    assert state is not None
    return state


def bits(codes: Iterable[int]) -> bytes:
    return sum(1 << code for code in codes).to_bytes(96, "little")


class FakeNode:
    """Kernel's end of an evdev device node, with the layouts of a 64-bit machine."""

    def __init__(
        self,
        keys: Iterable[int] = PAD_KEYS,
        effects: Iterable[int] = (0x50,),
        axes: Mapping[int, tuple[int, ...]] = AXES,
        room: int = 10_000,
    ) -> None:
        """axes: least, most and resting value, and the flat zone if not 0. room: events that the queue can hold."""
        ours, self._theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        ours.setblocking(False)
        self._theirs.setblocking(False)
        self.descriptor = ours.detach()
        self.axes, self.values = axes, {code: axis[2] for code, axis in axes.items()}
        self.down: set[int] = set()
        self.uploaded: list[tuple[int, int, int, int]] = []
        """Id, length in ms, strong and weak magnitude of each uploaded effect."""
        self._bits = {0x20: bits((0, KEY, ABS, FF)), 0x21: bits(keys), 0x23: bits(axes), 0x35: bits(effects)}
        self._room = room

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
            least, most, _, *flat = self.axes[number - 0x40]
            content[:] = struct.pack("=6i", self.values[number - 0x40], least, most, 0, *(flat or (0,)), 0)
        elif number == 0x06:
            content[:4] = b"Pad\0"
        elif number == 0x08:
            content[:18] = b"AA:BB:CC:00:00:01\0"
        elif number == 0x18:
            content[:] = bits(self.down)
            # Only the key events are dropped; the kernel keeps the first report even if nothing is left in it.
            self._queue([event for event in self._unread() if event[0] != KEY])
        else:
            content[:] = self._bits[number]
        return 0

    def happen(self, *events: Event) -> None:
        """Change axes and keys, and queue these events and the report's end; what does not fit is dropped."""
        for kind, code, value in events:
            if kind == KEY:
                (self.down.add if value else self.down.discard)(code)
            else:
                self.values[code] = value
        queue = self._unread()
        for event in (*events, REPORT):
            queue = [*queue, event] if len(queue) + 1 < self._room else [DROPPED, event]
        self._queue(queue)

    def send(self, *events: Event) -> None:
        """Queue these events and no other, whatever the present axes and keys."""
        self._queue([*self._unread(), *events])

    def _unread(self) -> list[Event]:
        content = b""
        with contextlib.suppress(BlockingIOError):
            while chunk := os.read(self.descriptor, 1 << 16):
                content += chunk
        return [(kind, code, value) for _, _, kind, code, value in EVENT.iter_unpack(content)]

    def _queue(self, events: list[Event]) -> None:
        self._theirs.sendall(b"".join(EVENT.pack(0, 0, *event) for event in events))

    def plays(self) -> list[tuple[int, int]]:
        try:
            content = self._theirs.recv(65536)
        except BlockingIOError:
            return []
        played = [EVENT.unpack_from(content, place)[2:] for place in range(0, len(content), EVENT.size)]
        assert all(kind == FF for kind, _, _ in played)
        return [(code, value) for _, code, value in played]

    def unplug(self) -> None:
        self._theirs.close()

    def close(self) -> None:
        self._theirs.close()
        with contextlib.suppress(OSError):
            os.close(self.descriptor)
