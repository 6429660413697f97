"""Input devices by the numbers of linux/input.h: where the axes stand, and which keys are down."""

import fcntl
import os
import struct
from pathlib import Path
from typing import Final

ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ, ABS_HAT0X, ABS_HAT0Y = 0, 1, 2, 3, 4, 5, 16, 17
BTN_SOUTH, BTN_TL, BTN_TOUCH = 0x130, 0x136, 0x14A

_GET_AXIS: Final = 0x80184540  # EVIOCGABS(0), a struct input_absinfo
_GET_KEYS: Final = 0x80604518  # EVIOCGKEY(96)
_AXIS = struct.Struct("=6i")
_KEY_BYTES = 96


class InputDevice:
    """An open /dev/input/event file."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDWR)

    def __enter__(self) -> "InputDevice":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)

    def axes(self, *codes: int) -> tuple[int, ...]:
        """The present values of absolute axes."""
        return tuple(self._axis(code) for code in codes)

    def _axis(self, code: int) -> int:
        content = bytearray(_AXIS.size)
        fcntl.ioctl(self._descriptor, _GET_AXIS + code, content)
        return int(_AXIS.unpack(content)[0])

    def is_down(self, code: int) -> bool:
        """Whether a key is pressed."""
        keys = bytearray(_KEY_BYTES)
        fcntl.ioctl(self._descriptor, _GET_KEYS, keys)
        return bool(keys[code // 8] >> code % 8 & 1)
