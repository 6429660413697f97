"""Device node of Linux evdev: its events, and what the kernel answers (linux/input.h)."""

import contextlib
import fcntl
import os
import struct
from collections.abc import Callable, Iterator
from typing import Any, Final

from common.errors import DeviceError
from operator_side.evdev.layout import Axis

SYN, KEY, ABS, FF = 0x00, 0x01, 0x03, 0x15
"""Kinds of events"""
SYN_REPORT, SYN_DROPPED, FF_RUMBLE = 0, 3, 0x50
_EVENT: Final = struct.Struct("@llHHi")
_ABSINFO: Final = struct.Struct("=6i")
_EFFECT: Final = struct.Struct("@HhHHHHH2xHH")
_EFFECT_SIZE: Final = 16 + struct.calcsize("@HHhhH4HIP")
"""Size of struct ff_effect, whose largest union member is a periodic effect"""
_MOST_EVENTS: Final = 64

Ioctl = Callable[[int, int, Any], Any]


def _request(direction: int, number: int, size: int) -> int:
    """Return _IOC of linux/ioctl.h for type "E"; direction: 1 writes, 2 reads."""
    return direction << 30 | size << 16 | ord("E") << 8 | number


_BIT_BYTES, _NAME_BYTES = 96, 256
GET_NAME: Final = _request(2, 0x06, _NAME_BYTES)
GET_UNIQUE: Final = _request(2, 0x08, _NAME_BYTES)
GET_KEYS: Final = _request(2, 0x18, _BIT_BYTES)
"""Request for the pressed keys. The kernel drops the key events that it has not given out yet."""
GET_BITS: Final = _request(2, 0x20, _BIT_BYTES)
"""Request for the supported codes of a kind of event; add the kind's number"""
_GET_AXIS: Final = _request(2, 0x40, _ABSINFO.size)
"""Request for an axis's value and range; add the axis's number"""
_SEND_EFFECT: Final = _request(1, 0x80, _EFFECT_SIZE)


class Node:
    """Open device node. Every method raises DeviceError once the device is unplugged or the node is closed."""

    def __init__(self, descriptor: int, ioctl: Ioctl = fcntl.ioctl) -> None:
        """descriptor: non-blocking; `close` closes it."""
        self._descriptor: int | None = descriptor
        self._ioctl = ioctl

    def events(self) -> Iterator[tuple[int, int, int]]:
        """Yield kind, code and value of each event that the kernel has queued, without waiting."""
        with _going_wrong(), contextlib.suppress(BlockingIOError):
            while True:
                content = os.read(self.open(), _MOST_EVENTS * _EVENT.size)
                if not content:
                    raise DeviceError("the gamepad is gone (end of its events): plug it in again")
                for _, _, *event in _EVENT.iter_unpack(content):
                    yield event[0], event[1], event[2]

    def bits(self, request: int) -> set[int]:
        """Return the codes whose bits are set in the answer to `request`."""
        content = self._asked(request, _BIT_BYTES)
        return {8 * place + bit for place, byte in enumerate(content) for bit in range(8) if byte >> bit & 1}

    def axis(self, code: int) -> Axis:
        """Return an axis's present value and range."""
        value, least, most, _, flat, _ = _ABSINFO.unpack(self._asked(_GET_AXIS + code, _ABSINFO.size))
        return Axis(value, least, most, flat)

    def text(self, request: int) -> str:
        """Return the answer to `request` as text; "" if the device has none."""
        content = bytearray(_NAME_BYTES)
        with contextlib.suppress(OSError):
            self._ioctl(self.open(), request, content)
        return content.partition(b"\0")[0].decode(errors="replace")

    def rumble(self, effect_id: int, strong: int, weak: int, length_ms: int) -> int:
        """Start an effect with these magnitudes; return its id. effect_id: of the one to change, -1 for a new one."""
        effect = bytearray(_EFFECT_SIZE)
        _EFFECT.pack_into(effect, 0, FF_RUMBLE, effect_id, 0, 0, 0, length_ms, 0, strong, weak)
        with _going_wrong():
            self._ioctl(self.open(), _SEND_EFFECT, effect)
        effect_id = _EFFECT.unpack_from(effect)[1]
        self.play(effect_id, 1)
        return effect_id

    def play(self, effect_id: int, times: int) -> None:
        """Start an effect, or stop it with `times` 0."""
        with _going_wrong():
            os.write(self.open(), _EVENT.pack(0, 0, FF, effect_id, times))

    def close(self) -> None:
        """Close the device node; safe to call again."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def open(self) -> int:
        """Return the descriptor; DeviceError if the node is closed."""
        if self._descriptor is None:
            raise DeviceError("the gamepad is closed; open it again")
        return self._descriptor

    def _asked(self, request: int, size: int) -> bytearray:
        content = bytearray(size)
        with _going_wrong():
            self._ioctl(self.open(), request, content)
        return content


@contextlib.contextmanager
def _going_wrong() -> Iterator[None]:
    """Turn OSError of the device node into DeviceError, but let BlockingIOError (nothing to read) pass."""
    try:
        yield
    except BlockingIOError:
        raise
    except OSError as error:
        raise DeviceError(f"the gamepad is gone ({os.strerror(error.errno or 0)}): plug it in again") from error
