"""What one input report says of the controller, in units a program can use."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.checks import check_integer, check_kind, check_number, check_numbers
from operator_side.dualsense.reports.attachments import CHARGED, ON_USB, Battery, Connections, TouchPoint

Stick = tuple[float, float]
Vector3 = tuple[float, float, float]

SENSOR_TICKS_PER_S: Final = 3_000_000
"""The sensor timestamp counts thirds of a microsecond."""
SENSOR_TIME_SPAN_S: Final = 2**32 / SENSOR_TICKS_PER_S
"""The sensor timestamp starts again at 0 after this long: 1431.7 s."""
SENSED_TRAVEL: Final = 0.75
"""The mechanical travel at which the controller reports 255 (about; DS4Windows issue 1751)."""
STANDARD_GRAVITY_M_S2: Final = 9.80665
AT_REST_M_S2: Final[Vector3] = (0.0, STANDARD_GRAVITY_M_S2, 0.0)
"""What the accelerometer says of a controller that lies flat: the table pushes it up, along y (SDL)."""


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


@dataclass(frozen=True, slots=True)
class TriggerFeedback:
    """What an adaptive trigger reports of itself: three nibbles, 0 to 15, as the controller sends them."""

    stop_location: int = 0
    """0 to 9 in every report seen so far."""
    status: int = 0
    """Feedback and vibration: 0 no load, 1 load; weapon: 0 ready, 1 firing, 2 fired (controllers wiki)."""
    active_effect: int = 0
    """0 other, 1 feedback, 2 weapon, 3 vibration."""

    def __post_init__(self) -> None:
        for name, value in (
            ("stop_location", self.stop_location),
            ("status", self.status),
            ("active_effect", self.active_effect),
        ):
            check_integer(name, value, 0, 15)


@dataclass(frozen=True, slots=True)
class ControllerState:
    """One input report; the defaults are a controller that nobody touches, flat on a table, charged, on USB.

    Bluetooth's simple reports lack most of it: what a report does not say is None.
    """

    left_stick: Stick = (0.0, 0.0)
    """(x, y), -1 to 1 each: right and up are positive. No dead zone is taken off."""
    right_stick: Stick = (0.0, 0.0)
    l2: float = 0.0
    """Raw travel as the controller measures it, 0 to 1; 1 comes at about 75 % of the mechanical travel."""
    r2: float = 0.0
    pressed: frozenset[Button] = frozenset()
    sequence: int = 0
    """0 to 255, one more with each report on USB. On Bluetooth always 1 (controllers wiki), to 63 in simple reports."""
    sensor_time_s: float | None = 0.0
    """The controller's clock, which wraps after SENSOR_TIME_SPAN_S."""
    l2_feedback: TriggerFeedback | None = TriggerFeedback()
    r2_feedback: TriggerFeedback | None = TriggerFeedback()
    gyro_rad_s: Vector3 | None = (0.0, 0.0, 0.0)
    """Turning about x (pitch), y (yaw) and z (roll)."""
    acceleration_m_s2: Vector3 | None = AT_REST_M_S2
    """Along x, y and z, gravity's reaction included."""
    touches: tuple[TouchPoint, ...] | None = ()
    """The fingers on the pad, two at most."""
    battery: Battery | None = CHARGED
    connections: Connections | None = ON_USB
    device_timestamp: int | None = 0
    """A counter of 32 bits whose unit is not known."""

    def __post_init__(self) -> None:
        for name, stick in (("left_stick", self.left_stick), ("right_stick", self.right_stick)):
            check_numbers(name, stick, 2, -1.0, 1.0)
        for name, travel in (("l2", self.l2), ("r2", self.r2)):
            check_number(name, travel, 0.0, 1.0)
        check_integer("sequence", self.sequence, 0, 255)
        time_s = self.sensor_time_s
        if time_s is not None and not (isinstance(time_s, int | float) and 0.0 <= time_s < SENSOR_TIME_SPAN_S):
            raise ValueError(f"sensor_time_s = {time_s}; valid: from 0 to below {SENSOR_TIME_SPAN_S}")
        for one, opposite in ((Button.UP, Button.DOWN), (Button.LEFT, Button.RIGHT)):
            if one in self.pressed and opposite in self.pressed:
                raise ValueError(f"pressed has {one.value} and {opposite.value}; valid: one of the two")
        for name, vector in (("gyro_rad_s", self.gyro_rad_s), ("acceleration_m_s2", self.acceleration_m_s2)):
            if vector is not None:
                check_numbers(name, vector, 3, -math.inf, math.inf)
        if self.touches is not None and len(self.touches) > 2:
            raise ValueError(f"touches has {len(self.touches)} points; valid: two at most")
        if self.device_timestamp is not None:
            check_integer("device_timestamp", self.device_timestamp, 0, 2**32 - 1)
        for name, part, kind in (
            ("l2_feedback", self.l2_feedback, TriggerFeedback),
            ("r2_feedback", self.r2_feedback, TriggerFeedback),
            ("battery", self.battery, Battery),
            ("connections", self.connections, Connections),
            *(("touches", touch, TouchPoint) for touch in self.touches or ()),
        ):
            if part is not None:
                check_kind(name, part, kind)
