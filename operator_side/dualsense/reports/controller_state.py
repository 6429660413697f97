"""The controller's state by one input report, in units that a program can use; the battery's byte, and back."""

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Final

from msgspec import Meta, Struct

from common.limits import Limited, Share, check_limits

Axis = Annotated[float, Meta(ge=-1.0, le=1.0)]
Stick = tuple[Axis, Axis]

SENSED_TRAVEL: Final = 0.75
"""The mechanical travel at which the controller reports 255 (about; DS4Windows issue 1751)."""


class Button(Enum):
    """Everything that is pressed or not; the directional pad counts as four buttons, two on a diagonal."""

    UP = "up"
    RIGHT = "right"
    DOWN = "down"
    LEFT = "left"
    SQUARE = "square"
    CROSS = "cross"
    CIRCLE = "circle"
    TRIANGLE = "triangle"
    L1 = "L1"
    R1 = "R1"
    L2 = "L2"
    """The trigger has left its rest."""
    R2 = "R2"
    CREATE = "create"
    OPTIONS = "options"
    L3 = "L3"
    """The left stick is pushed in."""
    R3 = "R3"
    PS = "PS"
    TOUCHPAD = "touchpad"
    MUTE = "mute"
    LEFT_FUNCTION = "left function"
    """This and the three below: DualSense Edge only."""
    RIGHT_FUNCTION = "right function"
    LEFT_PADDLE = "left paddle"
    RIGHT_PADDLE = "right paddle"


_OPPOSITES: Final = ({Button.UP, Button.DOWN}, {Button.LEFT, Button.RIGHT})


class BatteryState(Enum):
    """Charging state; the faults are those that Linux hid-playstation names."""

    DISCHARGING = "discharging"
    CHARGING = "charging"
    FULL = "full"
    OUT_OF_RANGE = "not charging: voltage or temperature out of range"
    TEMPERATURE = "not charging: temperature"
    FAULT = "charging fault"
    UNKNOWN = "unknown"


_STATES: Final = {
    0x0: BatteryState.DISCHARGING,
    0x1: BatteryState.CHARGING,
    0x2: BatteryState.FULL,
    0xA: BatteryState.OUT_OF_RANGE,
    0xB: BatteryState.TEMPERATURE,
    0xF: BatteryState.FAULT,
}
_CODES: Final = {state: code for code, state in _STATES.items()} | {BatteryState.UNKNOWN: 0x3}


@dataclass(frozen=True, slots=True)
class Battery(Limited):
    """Charge and charging state."""

    fraction: Share | None = 1.0
    """0 to 1 in steps of a tenth, the middle of each; None when the controller reports a fault instead."""
    state: BatteryState = BatteryState.FULL


CHARGED: Final = Battery()


def _battery(byte: int) -> Battery:
    """A step of the fraction stands for ten per cent, and the middle of them is meant (hid-playstation)."""
    state = _STATES.get(byte >> 4, BatteryState.UNKNOWN)
    if state is BatteryState.FULL:
        return Battery(1.0, state)
    if state not in (BatteryState.DISCHARGING, BatteryState.CHARGING):
        return Battery(None, state)
    return Battery(min((2 * (byte & 0x0F) + 1) / 20, 1.0), state)


BATTERIES: Final = tuple(_battery(byte) for byte in range(256))
"""The battery by its byte."""


def battery_byte(battery: Battery) -> int:
    """The byte that says `battery`."""
    tenths = 0 if battery.fraction is None else min(int(battery.fraction * 10 + 1e-9), 10)
    return _CODES[battery.state] << 4 | tenths


class ControllerState(Struct, frozen=True):
    """One input report; the defaults are a controller that nobody touches, charged."""

    left_stick: Stick = (0.0, 0.0)
    """(x, y), -1 to 1 each: right and up are positive. No dead zone is taken off."""
    right_stick: Stick = (0.0, 0.0)
    l2: Share = 0.0
    """Raw travel as the controller measures it, 0 to 1; 1 comes at about 75 % of the mechanical travel."""
    r2: Share = 0.0
    pressed: frozenset[Button] = frozenset()
    sequence: Annotated[int, Meta(ge=0, le=255)] = 0
    """One more with each report on USB. On Bluetooth always 1 (controllers wiki)."""
    battery: Battery = CHARGED

    def __post_init__(self) -> None:
        check_limits(self)
        for opposites in _OPPOSITES if self.pressed else ():
            if opposites <= self.pressed:
                one, other = sorted(button.value for button in opposites)
                raise ValueError(f"pressed has {one} and {other}; valid: one of the two")
