"""Driver of any gamepad with rumble on Linux, through evdev: its motors render the triggers' resistance.

The strength of the zone at a trigger's present travel drives a motor: L2's strength the strong motor, R2's the weak
motor. A commanded rumble counts if it is stronger. Layout of events and ioctls: linux/input.h. The kernel erases a
file's effects when the file is closed, so nothing keeps rumbling after the process is killed. Each effect also ends by
itself after 0.2 s, in case the process hangs.
"""

import contextlib
import fcntl
import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

from common.errors import DeviceError, NoDeviceError
from operator_side.controller.feel import MAX_STRENGTH, Feel, Strengths, met
from operator_side.controller.port import OpenController, checked_address
from operator_side.controller.state import Battery, BatteryState, Button, ControllerState

NODES: Final = Path("/dev/input")
LENGTH_S: Final = 0.2
"""Duration of an effect after the last command, in seconds; the same as the release watchdog's limit"""
_AGAIN_S: Final = LENGTH_S / 2
"""Seconds after which an unchanged effect is sent again"""
RELEASED_TRAVEL: Final = 0.05
"""Raw travel up to which a trigger counts as released, so that its strengths drive no motor"""
_FULL: Final = 0xFFFF

_SYN, _KEY, _ABS, _FF = 0x00, 0x01, 0x03, 0x15
_SYN_DROPPED, _FF_RUMBLE = 3, 0x50
_X, _Y, _Z, _RX, _RY, _RZ, _HAT_X, _HAT_Y = 0, 1, 2, 3, 4, 5, 16, 17
_AXES: Final = (_X, _Y, _Z, _RX, _RY, _RZ)
BUTTONS: Final = {
    0x130: Button.CROSS,
    0x131: Button.CIRCLE,
    0x133: Button.TRIANGLE,
    0x134: Button.SQUARE,
    0x136: Button.L1,
    0x137: Button.R1,
    0x138: Button.L2,
    0x139: Button.R2,
    0x13A: Button.CREATE,
    0x13B: Button.OPTIONS,
    0x13C: Button.PS,
    0x13D: Button.L3,
    0x13E: Button.R3,
}
"""Button for each evdev code of Linux's gamepad specification, which names action buttons by their direction"""
_HATS: Final = {
    (_HAT_X, -1): Button.LEFT,
    (_HAT_X, 1): Button.RIGHT,
    (_HAT_Y, -1): Button.UP,
    (_HAT_Y, 1): Button.DOWN,
}
_EVENT: Final = struct.Struct("@llHHi")
_ABSINFO: Final = struct.Struct("=6i")
_EFFECT: Final = struct.Struct("@HhHHHHH2xHH")
_EFFECT_SIZE: Final = 16 + struct.calcsize("@HHhhH4HIP")
"""Size of struct ff_effect, whose largest union member is a periodic effect"""
_MOST_EVENTS: Final = 64
_UNKNOWN_BATTERY: Final = Battery(None, BatteryState.UNKNOWN)

Ioctl = Callable[[int, int, Any], Any]


def _request(direction: int, number: int, size: int) -> int:
    """Return _IOC of linux/ioctl.h for type "E"; direction: 1 writes, 2 reads."""
    return direction << 30 | size << 16 | ord("E") << 8 | number


_KEY_BYTES, _BIT_BYTES, _NAME_BYTES = 96, 96, 256
GET_NAME: Final = _request(2, 0x06, _NAME_BYTES)
GET_UNIQUE: Final = _request(2, 0x08, _NAME_BYTES)
GET_KEYS: Final = _request(2, 0x18, _KEY_BYTES)
GET_BITS: Final = _request(2, 0x20, _BIT_BYTES)
"""Request for the supported codes of a kind of event; add the kind's number"""
GET_AXIS: Final = _request(2, 0x40, _ABSINFO.size)
"""Request for an axis's value and range; add the axis's number"""
SEND_EFFECT: Final = _request(1, 0x80, _EFFECT_SIZE)


class Axis(NamedTuple):
    """Range of one axis."""

    least: int
    most: int

    def share(self, value: int) -> float:
        """Return the position of `value` in the range, 0 to 1."""
        return min(max((value - self.least) / max(self.most - self.least, 1), 0.0), 1.0)


class EvdevPad:
    """Gamepad on an open device node, as a `Controller`. The same thread must read and write.

    Each read returns a state, even an unchanged one, as the kernel keeps the gamepad's state.
    """

    def __init__(self, descriptor: int, ioctl: Ioctl = fcntl.ioctl) -> None:
        """descriptor: non-blocking; `close` closes it. DeviceError if the gamepad is unplugged meanwhile."""
        self._descriptor: int | None = descriptor
        self._ioctl = ioctl
        self._changed = True
        self._state = ControllerState()
        self._commanded = Feel()
        self._effect_id = -1
        self._drives = (0, 0)
        self._said_s = 0.0
        with contextlib.ExitStack() as failing, _going_wrong():
            failing.callback(self.close)
            keys, axes, effects = (self._bits(GET_BITS + kind) for kind in (_KEY, _ABS, _FF))
            self.is_pad = min(BUTTONS) in keys and axes.issuperset(_AXES) and _FF_RUMBLE in effects
            """Whether the device has two sticks, two triggers, buttons and rumble."""
            self.name = self._text(GET_NAME)
            self.address = _address(self._text(GET_UNIQUE))
            self._hats = axes & {_HAT_X, _HAT_Y}
            self._ranges: dict[int, Axis] = {}
            self._values: dict[int, int] = {}
            self._down: set[int] = set()
            if self.is_pad:
                self._ask()
            failing.pop_all()

    @property
    def released(self) -> bool:
        """Whether the last command neither resists nor rumbles."""
        return self._commanded.releases

    def read(self, now_s: float) -> ControllerState | None:
        """Return the state after all events so far, and drive the motors by the triggers' new travel."""
        descriptor = self._open_descriptor()
        with _going_wrong(), contextlib.suppress(BlockingIOError):
            while True:
                content = os.read(descriptor, _MOST_EVENTS * _EVENT.size)
                if not content:
                    raise DeviceError("the gamepad is gone (end of its events): plug it in again")
                for _, _, kind, code, value in _EVENT.iter_unpack(content):
                    self._take(kind, code, value)
        if self._changed:
            self._changed, self._state = False, self._made()
        self._shake(now_s)
        return self._state

    def write(self, feel: Feel, now_s: float) -> None:
        """Render `feel` as rumble from now on; a light is ignored."""
        self._open_descriptor()
        self._commanded = feel.following(self._commanded)
        self._shake(now_s)

    def close(self) -> None:
        """Stop the motors and close the device node."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is None:
            return
        with contextlib.suppress(OSError):  # the gamepad is gone: nothing can be written
            if any(self._drives):
                os.write(descriptor, _played(self._effect_id, 0))
            self._commanded = self._commanded.farewell
        os.close(descriptor)

    def _take(self, kind: int, code: int, value: int) -> None:
        if kind == _KEY and code in BUTTONS:
            (self._down.add if value else self._down.discard)(code)
        elif kind == _ABS and code in self._values:
            self._values[code] = value
        elif kind == _SYN and code == _SYN_DROPPED:
            self._ask()  # events are missing
        else:
            return
        self._changed = True

    def _ask(self) -> None:
        """Read the present axes and buttons."""
        for axis in (*_AXES, *self._hats):
            content = bytearray(_ABSINFO.size)
            self._ioctl(self._open_descriptor(), GET_AXIS + axis, content)
            self._values[axis], least, most, *_ = _ABSINFO.unpack(content)
            self._ranges[axis] = Axis(least, most)
        self._down = self._bits(GET_KEYS) & BUTTONS.keys()

    def _made(self) -> ControllerState:
        across = {axis: 2.0 * self._ranges[axis].share(self._values[axis]) - 1.0 for axis in (_X, _Y, _RX, _RY)}
        hats = {_HATS[axis, value] for axis in self._hats if (axis, value := self._values[axis]) in _HATS}
        return ControllerState(
            left_stick=(across[_X], -across[_Y]),
            right_stick=(across[_RX], -across[_RY]),
            l2=self._ranges[_Z].share(self._values[_Z]),
            r2=self._ranges[_RZ].share(self._values[_RZ]),
            pressed=frozenset(BUTTONS[code] for code in self._down) | hats,
            battery=_UNKNOWN_BATTERY,
        )

    def _shake(self, now_s: float) -> None:
        """Drive the motors by the last command and the present travel; repeat an effect before it ends."""
        commanded, state = self._commanded, self._state
        left, right = (0.0, 0.0) if commanded.rumble is None else (commanded.rumble.left, commanded.rumble.right)
        drives = (
            round(_FULL * max(left, _share(commanded.l2, state.l2))),
            round(_FULL * max(right, _share(commanded.r2, state.r2))),
        )
        if drives == self._drives and (not any(drives) or 0.0 <= now_s - self._said_s < _AGAIN_S):
            return
        self._drives, self._said_s = drives, now_s
        with _going_wrong():
            descriptor = self._open_descriptor()
            # To stop, do not change the effect first: the kernel (ff-memless) would let the motors run on.
            if any(drives):
                effect = bytearray(_EFFECT_SIZE)
                _EFFECT.pack_into(effect, 0, _FF_RUMBLE, self._effect_id, 0, 0, 0, round(1e3 * LENGTH_S), 0, *drives)
                self._ioctl(descriptor, SEND_EFFECT, effect)
                self._effect_id = _EFFECT.unpack_from(effect)[1]
            os.write(descriptor, _played(self._effect_id, int(any(drives))))

    def _bits(self, request: int) -> set[int]:
        content = bytearray(_BIT_BYTES)
        self._ioctl(self._open_descriptor(), request, content)
        return {8 * place + bit for place, byte in enumerate(content) for bit in range(8) if byte >> bit & 1}

    def _text(self, request: int) -> str:
        content = bytearray(_NAME_BYTES)
        with contextlib.suppress(OSError):  # some have none
            self._ioctl(self._open_descriptor(), request, content)
        return content.partition(b"\0")[0].decode(errors="replace")

    def _open_descriptor(self) -> int:
        if self._descriptor is None:
            raise DeviceError("the gamepad is closed; open it again")
        return self._descriptor


def find_pad(preferred: str | None) -> OpenController:
    """Open the gamepad with the address `preferred`, else the first with rumble; NoDeviceError if there is none."""
    found: list[tuple[Path, EvdevPad]] = []
    denied: list[str] = []
    for path in sorted(NODES.glob("event*"), key=lambda path: (len(path.name), path.name)):
        try:
            found.append((path, EvdevPad(os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC))))
        except PermissionError:
            denied.append(path.name)
        except (OSError, DeviceError):
            continue  # gone meanwhile
    chosen = min(
        (pair for pair in found if pair[1].is_pad),
        key=lambda pair: preferred is not None and pair[1].address != preferred,
        default=None,
    )
    for pair in found:
        if pair is not chosen:
            pair[1].close()
    if chosen is None:
        hidden = (
            f"; not permitted to look at {', '.join(denied)}: a seat at this machine, or the group input, permits it"
        )
        raise NoDeviceError(f"no gamepad with two sticks, two triggers and rumble in {NODES}{hidden if denied else ''}")
    path, pad = chosen
    return OpenController(pad, f"{pad.name} at {path}, rumble in place of stiffness", pad.address)


def _played(effect_id: int, times: int) -> bytes:
    return _EVENT.pack(0, 0, _FF, effect_id, times)


def _share(strengths: Strengths | None, travel: float) -> float:
    return 0.0 if strengths is None or travel <= RELEASED_TRAVEL else met(strengths, travel) / MAX_STRENGTH


def _address(unique: str) -> str | None:
    try:
        return checked_address(unique.lower())
    except ValueError:
        return None


@contextlib.contextmanager
def _going_wrong() -> Iterator[None]:
    """Turn OSError of the device node into DeviceError, but let BlockingIOError (nothing to read) pass."""
    try:
        yield
    except BlockingIOError:
        raise
    except OSError as error:
        raise DeviceError(f"the gamepad is gone ({os.strerror(error.errno or 0)}): plug it in again") from error
