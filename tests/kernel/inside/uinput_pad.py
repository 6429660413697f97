"""A gamepad of any layout, which the kernel's uinput offers (linux/uinput.h)."""

import fcntl
import os
import struct
from collections.abc import Iterable, Mapping

_SET_KIND, _SET_KEY, _SET_AXIS, _SET_EFFECT = (0x40045500 | number for number in (100, 101, 103, 107))
_CREATE, _DESTROY = 0x5501, 0x5502
_DEVICE = struct.Struct("=80s4HI64i64i64i64i")
_EVENT = struct.Struct("@llHHi")
KEY, ABS, _FF, _RUMBLE = 1, 3, 0x15, 0x50


class UinputPad:
    """Gamepad with rumble, whose axes and keys a test moves."""

    def __init__(self, name: str, keys: Iterable[int], axes: Mapping[int, tuple[int, int]]) -> None:
        """axes: least and most value by code."""
        self._file = os.open("/dev/uinput", os.O_RDWR)
        for request, codes in (
            (_SET_KIND, (KEY, ABS, _FF)),
            (_SET_KEY, keys),
            (_SET_AXIS, axes),
            (_SET_EFFECT, (_RUMBLE,)),
        ):
            for code in codes:
                fcntl.ioctl(self._file, request, code)
        least, most = ([axes.get(code, (0, 0))[end] for code in range(64)] for end in (0, 1))
        os.write(self._file, _DEVICE.pack(name.encode(), 5, 1, 2, 3, 1, *most, *least, *[0] * 128))
        fcntl.ioctl(self._file, _CREATE)

    def __enter__(self) -> "UinputPad":
        return self

    def __exit__(self, *_: object) -> None:
        fcntl.ioctl(self._file, _DESTROY)
        os.close(self._file)

    def send(self, *events: tuple[int, int, int]) -> None:
        """Send events (kind, code, value) as one packet."""
        for event in (*events, (0, 0, 0)):
            os.write(self._file, _EVENT.pack(0, 0, *event))
