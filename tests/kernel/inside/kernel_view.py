"""A controller as the kernel shows it: its HID device under /sys, and its input devices (codes of linux/input.h)."""

import fcntl
import os
import struct
from pathlib import Path
from typing import Final

from operator_side.dualsense.reports.models import SONY_VENDOR_ID
from operator_side.dualsense.uhid.controller import BUS, UhidIdentity


class KernelView:
    """HID device of a controller, as a folder under /sys."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def driver(self) -> str | None:
        """Name of the kernel driver that is bound to the device; None if there is none."""
        link = self.folder / "driver"
        return link.resolve().name if link.exists() else None

    def inputs(self) -> dict[str, Path]:
        """Return the device file of each input device, by the input device's name."""
        found = {}
        for folder in sorted(self.folder.glob("input/input*")):
            events = sorted(folder.glob("event*"))
            if events:
                found[(folder / "name").read_text(encoding="utf-8").strip()] = Path("/dev/input") / events[0].name
        return found

    def hidraw(self) -> Path | None:
        """Return the hidraw device file, if there is one."""
        found = sorted(self.folder.glob("hidraw/hidraw*"))
        return Path("/dev") / found[0].name if found else None


def seen_device(identity: UhidIdentity) -> KernelView | None:
    """Return the HID device with the ids of `identity`; None if there is none."""
    ids = f"{BUS[identity.transport]:04X}:{SONY_VENDOR_ID:04X}:{identity.model.value:04X}."
    found = sorted(Path("/sys/bus/hid/devices").glob(f"{ids}*"))
    return KernelView(found[0]) if found else None


ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ, ABS_HAT0X, ABS_HAT0Y = 0, 1, 2, 3, 4, 5, 16, 17
BTN_SOUTH, BTN_TL, BTN_TOUCH = 0x130, 0x136, 0x14A

_GET_AXIS: Final = 0x80184540  # EVIOCGABS(0), a struct input_absinfo
_GET_KEYS: Final = 0x80604518  # EVIOCGKEY(96)
_AXIS = struct.Struct("=6i")
_KEY_BYTES = 96


class InputDevice:
    """An input device, opened as a file /dev/input/event*."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDWR)

    def __enter__(self) -> "InputDevice":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)

    def axes(self, *codes: int) -> tuple[int, ...]:
        """Return the present values of the absolute axes `codes`."""
        return tuple(self._axis(code) for code in codes)

    def _axis(self, code: int) -> int:
        content = bytearray(_AXIS.size)
        fcntl.ioctl(self._descriptor, _GET_AXIS + code, content)
        return int(_AXIS.unpack(content)[0])

    def is_down(self, code: int) -> bool:
        """Return whether a key is pressed."""
        keys = bytearray(_KEY_BYTES)
        fcntl.ioctl(self._descriptor, _GET_KEYS, keys)
        return bool(keys[code // 8] >> code % 8 & 1)
