"""Driver of any gamepad with rumble on Linux, through evdev: its motors render the triggers' resistance.

The strength of the zone at a trigger's present travel drives a motor: L2's strength the strong motor, R2's the weak
motor. A commanded rumble counts if it is stronger. The kernel erases a file's effects when the file is closed, so
nothing keeps rumbling after the process is killed. Each effect also ends by itself after 0.2 s, in case the process
hangs.
"""

import contextlib
import fcntl
import os
from pathlib import Path
from typing import Final

from common.errors import DeviceError, NoDeviceError
from operator_side.controller.feel import MAX_STRENGTH, Feel, Strengths, met
from operator_side.controller.port import OpenController, checked_address
from operator_side.controller.state import Battery, BatteryState, Button, ControllerState
from operator_side.evdev.layout import HAT_X, HAT_Y, Layout, is_controller, is_fresh, layout_of
from operator_side.evdev.node import (
    ABS,
    FF,
    FF_RUMBLE,
    GET_BITS,
    GET_KEYS,
    GET_NAME,
    GET_UNIQUE,
    KEY,
    SYN,
    SYN_DROPPED,
    SYN_REPORT,
    Ioctl,
    Node,
)

NODES: Final = Path("/dev/input")
LENGTH_S: Final = 0.2
"""Duration of an effect after the last command, in seconds; the same as the release watchdog's limit"""
_AGAIN_S: Final = LENGTH_S / 2
"""Seconds after which an unchanged effect is sent again"""
RELEASED_TRAVEL: Final = 0.05
"""Raw travel up to which a trigger counts as released, so that its strengths drive no motor"""
_FULL: Final = 0xFFFF

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
    0x220: Button.UP,
    0x221: Button.DOWN,
    0x222: Button.LEFT,
    0x223: Button.RIGHT,
}
"""Button for each evdev code of Linux's gamepad specification, which names action buttons by their direction"""
_HATS: Final = {
    (HAT_X, -1): Button.LEFT,
    (HAT_X, 1): Button.RIGHT,
    (HAT_Y, -1): Button.UP,
    (HAT_Y, 1): Button.DOWN,
}
_OPPOSITES: Final = ({Button.UP, Button.DOWN}, {Button.LEFT, Button.RIGHT})
_UNKNOWN_BATTERY: Final = Battery(None, BatteryState.UNKNOWN)


class EvdevPad:
    """Gamepad on an open device node, as a `Controller`. The same thread must read and write.

    Each read returns a state, even an unchanged one, as the kernel keeps the gamepad's state.
    """

    def __init__(self, descriptor: int, ioctl: Ioctl = fcntl.ioctl) -> None:
        """descriptor: non-blocking; `close` closes it. DeviceError if the gamepad is unplugged meanwhile."""
        self._node = Node(descriptor, ioctl)
        self._changed, self._gap = True, False
        self._state = ControllerState()
        self._commanded = Feel()
        self._effect_id = -1
        self._drives = (0, 0)
        self._said_s = 0.0
        with contextlib.ExitStack() as failing:
            failing.callback(self.close)
            keys, axes, effects = (self._node.bits(GET_BITS + kind) for kind in (KEY, ABS, FF))
            self.is_controller = is_controller(keys)
            """Whether it is a joystick, wheel or gamepad, and no mouse or the like."""
            self.name = self._node.text(GET_NAME)
            self.address = _address(self._node.text(GET_UNIQUE))
            self._axes = {code: self._node.axis(code) for code in axes} if self.is_controller else {}
            self._keys, self._rumbles, self._fresh = keys, FF_RUMBLE in effects, is_fresh(self._axes)
            found = layout_of(keys, self._axes, rumbles=self._rumbles)
            self.layout = found if isinstance(found, Layout) else None
            """Axes of sticks and triggers; None if the device cannot be used."""
            self.lacks = "" if isinstance(found, Layout) else found
            """Missing parts of a device that cannot be used, in words, with the axes that it has."""
            self._values: dict[int, int] = {}
            self._down: set[int] = set()
            if self.is_pad:
                self._ask()
            failing.pop_all()

    @property
    def is_pad(self) -> bool:
        """Whether the device has two sticks, two triggers, buttons and rumble."""
        return self.layout is not None

    @property
    def released(self) -> bool:
        """Whether the last command neither resists nor rumbles."""
        return self._commanded.releases

    def read(self, now_s: float) -> ControllerState | None:
        """Return the state after all events so far, and drive the motors by the triggers' new travel."""
        # What was queued before the kernel is asked may contradict its answer only until the newest event is read.
        while self._take_events():
            self._ask()
        if self._changed:
            self._changed, self._state = False, self._made()
        self._shake(now_s)
        return self._state

    def write(self, feel: Feel, now_s: float) -> None:
        """Render `feel` as rumble from now on; a light is ignored."""
        self._node.open()
        self._commanded = feel.completed_from(self._commanded)
        self._shake(now_s)

    def close(self) -> None:
        """Stop the motors and close the device node."""
        with contextlib.suppress(DeviceError):  # the gamepad is gone: nothing can be written
            if any(self._drives):
                self._node.play(self._effect_id, 0)
            self._commanded = self._commanded.farewell
        self._node.close()

    def _take_events(self) -> bool:
        """Take all queued events; return whether some are missing, so that the kernel must be asked.

        A packet of events in which some are missing is dropped whole: up to the next SYN_REPORT.
        """
        missing = False
        for kind, code, value in self._node.events():
            if kind == SYN and code == SYN_DROPPED:
                missing = self._gap = True
            elif kind == SYN and code == SYN_REPORT:
                missing, self._gap = missing or self._gap, False
                self._look_again()
            elif self._gap:
                continue
            elif kind == KEY and code in BUTTONS:
                (self._down.add if value else self._down.discard)(code)
                self._changed = True
            elif kind == ABS and code in self._axes:
                self._values[code] = value
                self._changed = True
        return missing

    def _ask(self) -> None:
        """Ask for the present axes and buttons. An axis that never moved is 0, wherever it rests: it stays unknown."""
        for code in self._axes:
            value = self._node.axis(code).value
            if value != 0 or code in self._values:
                self._values[code] = value
        self._down = self._node.bits(GET_KEYS) & BUTTONS.keys()
        self._changed = True
        self._look_again()

    def _look_again(self) -> None:
        """Lay the axes out by where they rest, with the first values that come."""
        if not self._fresh:
            return
        moved = {code: axis._replace(value=self._values.get(code, 0)) for code, axis in self._axes.items()}
        found, self._fresh = layout_of(self._keys, moved, rumbles=self._rumbles), is_fresh(moved)
        if isinstance(found, Layout):
            self.layout = found

    def _made(self) -> ControllerState:
        if self.layout is None:
            return ControllerState()
        left, right, triggers, hats = self.layout
        axes, values = self._axes, self._values
        (left_x, left_y), (right_x, right_y) = (
            [axes[code].deflection(values.get(code)) for code in stick] for stick in (left, right)
        )
        l2, r2 = (axes[code].travel(values.get(code)) for code in triggers)
        pressed = {BUTTONS[code] for code in self._down}
        pressed |= {_HATS[at] for hat in hats if (at := (hat, values.get(hat, 0))) in _HATS}
        for opposites in _OPPOSITES:
            if opposites <= pressed:
                pressed -= opposites
        return ControllerState(
            left_stick=(left_x, 0.0 - left_y),
            right_stick=(right_x, 0.0 - right_y),
            l2=l2,
            r2=r2,
            pressed=frozenset(pressed),
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
        if any(drives):
            self._effect_id = self._node.rumble(self._effect_id, *drives, round(1e3 * LENGTH_S))
        else:
            # Without changing the effect first: the kernel (ff-memless) would let the motors run on.
            self._node.play(self._effect_id, 0)


def find_pad(preferred: str | None) -> OpenController:
    """Open the gamepad with the address `preferred`, else the first with rumble; NoDeviceError if there is none."""
    found, denied = controllers_seen()
    chosen = min(
        (pair for pair in found if pair[1].is_pad),
        key=lambda pair: preferred is not None and pair[1].address != preferred,
        default=None,
    )
    for pair in found:
        if pair is not chosen:
            pair[1].close()
    if chosen is None:
        refused = "".join(f"; {pad.name} at {path}: {pad.lacks}" for path, pad in found)
        hidden = f"; this user may not open {', '.join(denied)}: log in at this machine, or join the group input"
        raise NoDeviceError(
            f"no gamepad with two sticks, two triggers and rumble in {NODES}{refused}{hidden if denied else ''}"
        )
    path, pad = chosen
    return OpenController(pad, f"{pad.name} at {path}, rumble in place of stiffness", pad.address)


def controllers_seen() -> tuple[list[tuple[Path, EvdevPad]], list[str]]:
    """Open every joystick, wheel and gamepad; return these, and the names of the nodes that this user may not open."""
    found: list[tuple[Path, EvdevPad]] = []
    denied: list[str] = []
    for path in sorted(NODES.glob("event*"), key=lambda path: (len(path.name), path.name)):
        try:
            pad = EvdevPad(os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC))
        except PermissionError:
            denied.append(path.name)
        except (OSError, DeviceError):
            continue  # gone meanwhile
        else:
            found.append((path, pad)) if pad.is_controller else pad.close()
    return found, denied


def _share(strengths: Strengths | None, travel: float) -> float:
    return 0.0 if strengths is None or travel <= RELEASED_TRAVEL else met(strengths, travel) / MAX_STRENGTH


def _address(unique: str) -> str | None:
    try:
        return checked_address(unique.lower())
    except ValueError:
        return None
