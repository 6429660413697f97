"""Parts of a controller's state besides sticks and buttons: the fingers on its pad, its battery, its sockets."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

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
        if 0 <= self.identity <= 127 and 0 <= self.x <= _TWELVE_BITS and 0 <= self.y <= _TWELVE_BITS:
            return  # made for every report while a finger is down
        for name, value, highest in (
            ("identity", self.identity, 127),
            ("x", self.x, _TWELVE_BITS),
            ("y", self.y, _TWELVE_BITS),
        ):
            if not 0 <= value <= highest:
                raise ValueError(f"{name} = {value}; valid: 0 to {highest}")


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
        if self.fraction is not None and not 0.0 <= self.fraction <= 1.0:
            raise ValueError(f"fraction = {self.fraction}; valid: 0 to 1, or None")


CHARGED: Final = Battery()


@dataclass(frozen=True, slots=True)
class Connections:
    """What is plugged into the controller, and whether its microphone is muted."""

    headphones: bool = False
    microphone: bool = False
    muted: bool = False
    usb_data: bool = True
    usb_power: bool = True


ON_USB: Final = Connections()
ON_BLUETOOTH: Final = Connections(usb_data=False, usb_power=False)
