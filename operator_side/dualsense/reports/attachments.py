"""Parts of a controller's state besides sticks and buttons: the fingers on its pad, its battery, its sockets."""

from dataclasses import dataclass, fields
from enum import Enum
from typing import Final

from common.checks import check_integer, check_kind, check_number

TOUCHPAD_SIZE: Final = (1920, 1080)
"""The pad's width and height in its own units, from the top left."""
_TWELVE_BITS: Final = 4095


@dataclass(frozen=True, slots=True)
class TouchPoint:
    """A finger on the pad."""

    identity: int
    """0 to 127: the same as long as the finger stays down, another for the next one."""
    x: int
    """To the right, in pad units: below 1920 on every controller; the wire has room to 4095."""
    y: int
    """Downwards, in pad units: below 1080."""

    def __post_init__(self) -> None:
        # Made for every report while a finger is down, hence at one go: a float has no `|`, and the lowest number of
        # too many bits, or any below 0, leaves the range whatever the others are.
        try:
            if 0 <= (self.identity << 5 | self.x | self.y) <= _TWELVE_BITS:
                return
        except TypeError:
            pass  # said below
        for name, value, highest in (
            ("identity", self.identity, 127),
            ("x", self.x, _TWELVE_BITS),
            ("y", self.y, _TWELVE_BITS),
        ):
            check_integer(name, value, 0, highest)


class BatteryState(Enum):
    """What the battery is doing; the faults are those that Linux hid-playstation names."""

    DISCHARGING = "discharging"
    CHARGING = "charging"
    FULL = "full"
    OUT_OF_RANGE = "not charging: voltage or temperature out of range"
    TEMPERATURE = "not charging: temperature"
    FAULT = "charging fault"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Battery:
    """How full the battery is, and what it is doing."""

    fraction: float | None = 1.0
    """0 to 1 in steps of a tenth, the middle of each; None when the controller reports a fault instead."""
    state: BatteryState = BatteryState.FULL

    def __post_init__(self) -> None:
        if self.fraction is not None:
            check_number("fraction", self.fraction, 0.0, 1.0)
        check_kind("state", self.state, BatteryState)


CHARGED: Final = Battery()


@dataclass(frozen=True, slots=True)
class Connections:
    """What is plugged into the controller, and whether its microphone is muted."""

    headphones: bool = False
    microphone: bool = False
    muted: bool = False
    usb_data: bool = True
    usb_power: bool = True

    def __post_init__(self) -> None:
        for part in fields(self):
            check_kind(part.name, getattr(self, part.name), bool)


ON_USB: Final = Connections()
ON_BLUETOOTH: Final = Connections(usb_data=False, usb_power=False)
