"""Input devices by the numbers of linux/input.h: where the axes stand, which keys are down, and force feedback."""

import array
import fcntl
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ, ABS_HAT0X, ABS_HAT0Y = 0, 1, 2, 3, 4, 5, 16, 17
BTN_SOUTH, BTN_TL, BTN_TOUCH = 0x130, 0x136, 0x14A

_GET_AXIS: Final = 0x80184540  # EVIOCGABS(0), a struct input_absinfo
_GET_KEYS: Final = 0x80604518  # EVIOCGKEY(96)
_SEND_EFFECT: Final = 0x40304580  # EVIOCSFF, a struct ff_effect
_AXIS = struct.Struct("=6i")
_KEY_BYTES = 96
# Kind, id, direction, trigger (button, interval), replay (length, delay); padding; strong and weak motor.
_RUMBLE = struct.Struct("=HhHHHHH2xHH28x")
_EVENT = struct.Struct("=qqHHi")
_EV_FF, _FF_RUMBLE, _NEW_EFFECT = 0x15, 0x50, -1


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis's value and range."""

    value: int
    minimum: int
    maximum: int
    resolution: int
    """Units a millimetre, a degree per second or a g, as the axis has it."""


class InputDevice:
    """An open /dev/input/event file."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDWR)

    def __enter__(self) -> "InputDevice":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)

    def axis(self, code: int) -> Axis:
        """The present state of an absolute axis."""
        content = bytearray(_AXIS.size)
        fcntl.ioctl(self._descriptor, _GET_AXIS + code, content)
        value, minimum, maximum, _, _, resolution = _AXIS.unpack(content)
        return Axis(value, minimum, maximum, resolution)

    def axes(self, *codes: int) -> tuple[int, ...]:
        """The present values of several axes."""
        return tuple(self.axis(code).value for code in codes)

    def is_down(self, code: int) -> bool:
        """Whether a key is pressed."""
        keys = bytearray(_KEY_BYTES)
        fcntl.ioctl(self._descriptor, _GET_KEYS, keys)
        return bool(keys[code // 8] >> code % 8 & 1)

    def rumble(self, strong: float, weak: float, length_ms: int) -> None:
        """Play a rumble, 0 to 1 each; closing the file ends it."""
        effect = array.array(
            "B",
            _RUMBLE.pack(_FF_RUMBLE, _NEW_EFFECT, 0, 0, 0, length_ms, 0, round(strong * 0xFFFF), round(weak * 0xFFFF)),
        )
        fcntl.ioctl(self._descriptor, _SEND_EFFECT, effect, True)
        number = struct.unpack_from("=h", effect, 2)[0]
        os.write(self._descriptor, _EVENT.pack(0, 0, _EV_FF, number, 1))
