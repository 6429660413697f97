"""The controller's state by one input report, in units that a program can use."""

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Final

from msgspec import Meta

from common.limits import Share, check_limits
from operator_side.dualsense.reports.battery import CHARGED, Battery

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


@dataclass(frozen=True, slots=True)
class ControllerState:
    """One input report; the defaults are a controller that nobody touches, charged."""

    left_stick: Stick = (0.0, 0.0)
    """(x, y), -1 to 1 each: right and up are positive. No dead zone is taken off."""
    right_stick: Stick = (0.0, 0.0)
    l2: Share = 0.0
    """Raw travel as the controller measures it, 0 to 1; 1 comes at about 75 % of the mechanical travel."""
    r2: Share = 0.0
    pressed: frozenset[Button] = frozenset()
    sequence: Annotated[int, Meta(ge=0, le=255)] = 0
    """One more with each report on USB. On Bluetooth always 1 (controllers wiki), to 63 in simple reports."""
    battery: Battery | None = CHARGED
    """None in Bluetooth's simple reports, which do not tell."""

    def __post_init__(self) -> None:
        check_limits(self)
        for opposites in _OPPOSITES:
            if opposites <= self.pressed:
                one, other = sorted(button.value for button in opposites)
                raise ValueError(f"pressed has {one} and {other}; valid: one of the two")
