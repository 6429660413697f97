"""State of a controller: sticks, triggers and buttons, in units that do not depend on its model."""

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Final

from msgspec import Meta, Struct

from common.limits import Limited, Share, check_limits

Axis = Annotated[float, Meta(ge=-1.0, le=1.0)]
Stick = tuple[Axis, Axis]


class Button(Enum):
    """Button of a controller. The directional pad counts as four buttons; a diagonal presses two of them."""

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
    """Pressed when the trigger has left its rest position"""
    R2 = "R2"
    CREATE = "create"
    OPTIONS = "options"
    L3 = "L3"
    """Pressed when the left stick is pushed in"""
    R3 = "R3"
    PS = "PS"
    TOUCHPAD = "touchpad"
    MUTE = "mute"
    LEFT_FUNCTION = "left function"
    """The function keys and the paddles exist only on the DualSense Edge."""
    RIGHT_FUNCTION = "right function"
    LEFT_PADDLE = "left paddle"
    RIGHT_PADDLE = "right paddle"


_OPPOSITES: Final = ({Button.UP, Button.DOWN}, {Button.LEFT, Button.RIGHT})


class BatteryState(Enum):
    """Charging state of the battery; faults as Linux hid-playstation names them."""

    DISCHARGING = "discharging"
    CHARGING = "charging"
    FULL = "full"
    OUT_OF_RANGE = "not charging: voltage or temperature out of range"
    TEMPERATURE = "not charging: temperature"
    FAULT = "charging fault"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Battery(Limited):
    """Charge and charging state."""

    fraction: Share | None = 1.0
    """Charge, 0 to 1; None if the controller does not report it, or reports a fault."""
    state: BatteryState = BatteryState.FULL


CHARGED: Final = Battery()


class ControllerState(Struct, frozen=True):
    """State of sticks, triggers, buttons and battery; by default untouched and charged."""

    left_stick: Stick = (0.0, 0.0)
    """(x, y), -1 to 1 each, right and up positive; no dead zone is applied."""
    right_stick: Stick = (0.0, 0.0)
    l2: Share = 0.0
    """Raw travel as the controller measures it, 0 to 1."""
    r2: Share = 0.0
    pressed: frozenset[Button] = frozenset()
    battery: Battery = CHARGED

    def __post_init__(self) -> None:
        check_limits(self)
        for opposites in _OPPOSITES if self.pressed else ():
            if opposites <= self.pressed:
                one, other = sorted(button.value for button in opposites)
                raise ValueError(f"pressed has {one} and {other}; valid: one of the two")
