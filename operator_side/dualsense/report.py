"""USB reports of the DualSense, bytes to values and back, in both directions.

Offsets count from the report id at 0. Input report 0x01, 64 bytes; output report 0x02, 48 bytes. Layout:
Linux hid-playstation, SDL and Nielk1's notes, which agree. The driver reads input and writes output reports; the
simulated controller does the reverse.
"""

from dataclasses import dataclass
from typing import Final

from common.errors import RemoteProtocolError
from operator_side.dualsense.controller_state import (
    SENSOR_TICKS_PER_S,
    Button,
    ControllerState,
    TriggerFeedback,
)
from operator_side.dualsense.effects import DEBUG_CODES, EFFECT_LENGTH, TriggerEffect, decode_effect

__all__ = [
    "INPUT_REPORT_ID",
    "INPUT_REPORT_LENGTH",
    "OUTPUT_REPORT_ID",
    "OUTPUT_REPORT_LENGTH",
    "Button",
    "ControllerState",
    "OutputReport",
    "Rumble",
    "TriggerFeedback",
    "build_input_report",
    "build_output_report",
    "parse_input_report",
    "parse_output_report",
]

INPUT_REPORT_ID: Final = 0x01
INPUT_REPORT_LENGTH: Final = 64
OUTPUT_REPORT_ID: Final = 0x02
OUTPUT_REPORT_LENGTH: Final = 48
_OUTPUT_REPORT_MAX_LENGTH = 64  # some programs pad it to the length of an input report

# Input report
_STICKS, _L2, _R2, _SEQUENCE, _HAT, _SENSOR_TIME = 1, 5, 6, 7, 8, 28
_TOUCH_POINTS, _R2_FEEDBACK, _L2_FEEDBACK, _ACTIVE_EFFECTS, _BATTERY, _PLUGS = (33, 37), 42, 43, 48, 53, 54
_NOT_TOUCHED, _BATTERY_FULL, _USB_DATA_AND_POWER = 0x80, 0x2A, 0x18

_HAT_DIRECTIONS: Final = (
    frozenset({Button.UP}),
    frozenset({Button.UP, Button.RIGHT}),
    frozenset({Button.RIGHT}),
    frozenset({Button.DOWN, Button.RIGHT}),
    frozenset({Button.DOWN}),
    frozenset({Button.DOWN, Button.LEFT}),
    frozenset({Button.LEFT}),
    frozenset({Button.UP, Button.LEFT}),
)
"""Clockwise from up; any other number is HID's null state: no direction."""
_HAT_NONE = 8
_DIRECTIONS: Final = frozenset({Button.UP, Button.RIGHT, Button.DOWN, Button.LEFT})

_BUTTON_BITS: Final = {
    Button.SQUARE: (8, 4),
    Button.CROSS: (8, 5),
    Button.CIRCLE: (8, 6),
    Button.TRIANGLE: (8, 7),
    Button.L1: (9, 0),
    Button.R1: (9, 1),
    Button.L2: (9, 2),
    Button.R2: (9, 3),
    Button.CREATE: (9, 4),
    Button.OPTIONS: (9, 5),
    Button.L3: (9, 6),
    Button.R3: (9, 7),
    Button.PS: (10, 0),
    Button.TOUCHPAD: (10, 1),
    Button.MUTE: (10, 2),
    Button.LEFT_FUNCTION: (10, 4),
    Button.RIGHT_FUNCTION: (10, 5),
    Button.LEFT_PADDLE: (10, 6),
    Button.RIGHT_PADDLE: (10, 7),
}
"""(byte, bit) of every button but the directional pad's."""

# Output report
_FLAGS_0, _MOTOR_RIGHT, _MOTOR_LEFT, _R2_EFFECT, _L2_EFFECT, _FLAGS_2 = 1, 3, 4, 11, 22, 39
_CLASSIC_RUMBLE, _SELECT_RUMBLE, _SET_R2_EFFECT, _SET_L2_EFFECT = 0x01, 0x02, 0x04, 0x08
_CLASSIC_RUMBLE_V2 = 0x04  # in the third byte of flags


def _axis_from_byte(byte: int) -> float:
    """-1 at 0, 0 at 128, 1 at 255: the halves differ by one step."""
    return (byte - 128) / (127 if byte > 128 else 128)


def _byte_from_axis(axis: float) -> int:
    return 128 + round(axis * (127 if axis > 0.0 else 128))


def _check_id_and_length(kind: str, report: bytes, report_id: int, shortest: int, longest: int) -> None:
    if not report or report[0] != report_id or not shortest <= len(report) <= longest:
        length = f"{shortest}" if shortest == longest else f"{shortest} to {longest}"
        found = f"id 0x{report[0]:02x}, {len(report)} bytes" if report else "no bytes"
        raise RemoteProtocolError(f"{kind} report: {found}; valid: id 0x{report_id:02x}, {length} bytes (USB)")


def parse_input_report(report: bytes) -> ControllerState:
    """Read input report 0x01; every report of that id and length is valid.

    RemoteProtocolError names the id and the length of any other.
    """
    _check_id_and_length("input", report, INPUT_REPORT_ID, INPUT_REPORT_LENGTH, INPUT_REPORT_LENGTH)
    left_x, left_y, right_x, right_y = report[_STICKS : _STICKS + 4]
    pressed = {button for button, (byte, bit) in _BUTTON_BITS.items() if report[byte] >> bit & 1}
    hat = report[_HAT] & 0x0F
    if hat < len(_HAT_DIRECTIONS):
        pressed |= _HAT_DIRECTIONS[hat]
    ticks = int.from_bytes(report[_SENSOR_TIME : _SENSOR_TIME + 4], "little")
    return ControllerState(
        # Down is positive on the wire.
        left_stick=(_axis_from_byte(left_x), 0.0 - _axis_from_byte(left_y)),
        right_stick=(_axis_from_byte(right_x), 0.0 - _axis_from_byte(right_y)),
        l2=report[_L2] / 255,
        r2=report[_R2] / 255,
        pressed=frozenset(pressed),
        sequence=report[_SEQUENCE],
        sensor_time_s=ticks / SENSOR_TICKS_PER_S,
        l2_feedback=_trigger_feedback(report[_L2_FEEDBACK], report[_ACTIVE_EFFECTS] >> 4),
        r2_feedback=_trigger_feedback(report[_R2_FEEDBACK], report[_ACTIVE_EFFECTS] & 0x0F),
    )


def _trigger_feedback(byte: int, active_effect: int) -> TriggerFeedback:
    return TriggerFeedback(stop_location=byte & 0x0F, status=byte >> 4, active_effect=active_effect)


def build_input_report(state: ControllerState) -> bytes:
    """Make the input report 0x01 of a controller in `state`, rounded to the wire's steps.

    What ControllerState does not hold reads as an idle controller: nothing touches the pad, the motion
    sensors are 0, the battery is full and USB is plugged in.
    """
    report = bytearray(INPUT_REPORT_LENGTH)
    report[0] = INPUT_REPORT_ID
    for index, stick in enumerate((state.left_stick, state.right_stick)):
        report[_STICKS + 2 * index] = _byte_from_axis(stick[0])
        report[_STICKS + 2 * index + 1] = _byte_from_axis(-stick[1])
    report[_L2] = round(state.l2 * 255)
    report[_R2] = round(state.r2 * 255)
    report[_SEQUENCE] = state.sequence
    directions = state.pressed & _DIRECTIONS
    report[_HAT] = _HAT_DIRECTIONS.index(directions) if directions else _HAT_NONE
    for button in state.pressed - _DIRECTIONS:
        byte, bit = _BUTTON_BITS[button]
        report[byte] |= 1 << bit
    ticks = round(state.sensor_time_s * SENSOR_TICKS_PER_S) % 2**32
    report[_SENSOR_TIME : _SENSOR_TIME + 4] = ticks.to_bytes(4, "little")
    for touch_point in _TOUCH_POINTS:
        report[touch_point] = _NOT_TOUCHED
    l2, r2 = state.l2_feedback, state.r2_feedback
    report[_L2_FEEDBACK] = l2.status << 4 | l2.stop_location
    report[_R2_FEEDBACK] = r2.status << 4 | r2.stop_location
    report[_ACTIVE_EFFECTS] = l2.active_effect << 4 | r2.active_effect
    report[_BATTERY] = _BATTERY_FULL
    report[_PLUGS] = _USB_DATA_AND_POWER
    return bytes(report)


@dataclass(frozen=True, slots=True)
class Rumble:
    """The two motors' drive, 0 to 1 each; 256 steps on the wire."""

    left: float = 0.0
    right: float = 0.0

    def __post_init__(self) -> None:
        for name, drive in (("left", self.left), ("right", self.right)):
            if not 0.0 <= drive <= 1.0:
                raise ValueError(f"{name} = {drive}; valid: 0 to 1")


@dataclass(frozen=True, slots=True)
class OutputReport:
    """What one output report sets; None leaves a part of the controller as it is."""

    l2: TriggerEffect | None = None
    r2: TriggerEffect | None = None
    rumble: Rumble | None = None


def build_output_report(
    l2: TriggerEffect | None = None, r2: TriggerEffect | None = None, rumble: Rumble | None = None
) -> bytes:
    """Make output report 0x02, 48 bytes; only the flags of what is not None are set.

    So it never touches what other programs own: the lights, the mute key, the sound. ValueError for an
    object that is no trigger effect: nothing else may choose a code.
    """
    report = bytearray(OUTPUT_REPORT_LENGTH)
    report[0] = OUTPUT_REPORT_ID
    for name, effect, start, flag in (
        ("l2", l2, _L2_EFFECT, _SET_L2_EFFECT),
        ("r2", r2, _R2_EFFECT, _SET_R2_EFFECT),
    ):
        if effect is None:
            continue
        if not isinstance(effect, TriggerEffect):
            raise ValueError(f"{name} = {effect!r}; valid: Off, Feedback, MultiPositionFeedback or None")
        report[_FLAGS_0] |= flag
        report[start : start + EFFECT_LENGTH] = effect.encode()
    if rumble is not None:
        report[_FLAGS_0] |= _CLASSIC_RUMBLE | _SELECT_RUMBLE
        report[_MOTOR_LEFT] = round(rumble.left * 255)
        report[_MOTOR_RIGHT] = round(rumble.right * 255)
    return bytes(report)


def parse_output_report(report: bytes) -> OutputReport:
    """Read output report 0x02, 48 to 64 bytes; flags for other parts of the controller are passed over.

    RemoteProtocolError for another id or length, for an effect that does not decode, and for a debug code in
    either trigger's place even where its flag is not set.
    """
    _check_id_and_length("output", report, OUTPUT_REPORT_ID, OUTPUT_REPORT_LENGTH, _OUTPUT_REPORT_MAX_LENGTH)
    for start in (_L2_EFFECT, _R2_EFFECT):
        if report[start] in DEBUG_CODES:
            raise RemoteProtocolError(f"output report: debug effect code 0x{report[start]:02x}; valid: none")
    flags = report[_FLAGS_0]
    rumbles = flags & _CLASSIC_RUMBLE or report[_FLAGS_2] & _CLASSIC_RUMBLE_V2
    return OutputReport(
        l2=_effect_at(report, _L2_EFFECT) if flags & _SET_L2_EFFECT else None,
        r2=_effect_at(report, _R2_EFFECT) if flags & _SET_R2_EFFECT else None,
        rumble=Rumble(report[_MOTOR_LEFT] / 255, report[_MOTOR_RIGHT] / 255) if rumbles else None,
    )


def _effect_at(report: bytes, start: int) -> TriggerEffect:
    return decode_effect(report[start : start + EFFECT_LENGTH])
