"""Encoding and decoding of input reports: 0x01 on USB, 0x31 on Bluetooth.

The driver decodes them; the simulated controller encodes them. Layout: Linux hid-playstation, SDL and the controllers
wiki, which agree. Touch, motion and the triggers' own feedback are not decoded, as nothing here uses them.
"""

import struct
from functools import lru_cache
from typing import Final

from common.errors import RemoteProtocolError
from operator_side.controller.state import Battery, BatteryState, Button, ControllerState
from operator_side.dualsense.reports.transport import (
    CHECKSUM_LENGTH,
    INPUT_FRAMING,
    Seed,
    Transport,
    check,
    described,
    is_simple_report,
    sealed,
    transport_of_input,
)

# Offsets in the common block: sticks 0-3, triggers 4-5, sequence 6, buttons 7-9, accelerometer's y 23-24, sensor
# timestamp 27-30, touch points at 32 and 36, battery 52, sockets 53.
_COMMON: Final = struct.Struct("<7B3B13xh2xIxB3xB15xBB")
_GRAVITY: Final = 8192
_NOT_TOUCHED: Final = 0x80
_USB_DATA_AND_POWER: Final = 0x18
_SENSOR_TICKS_PER_S: Final = 3_000_000
_HAS_STATE: Final = 0x01
"""Flag in the low bits of a Bluetooth report's second byte: the report has the controller's state (wiki)"""

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
"""Buttons of the directional pad for each code 0 to 7, clockwise from up; any other code means none"""
_HAT_NONE: Final = 8
_DIRECTIONS: Final = frozenset({Button.UP, Button.RIGHT, Button.DOWN, Button.LEFT})

_BUTTON_BITS: Final = {
    Button.SQUARE: 4,
    Button.CROSS: 5,
    Button.CIRCLE: 6,
    Button.TRIANGLE: 7,
    Button.L1: 8,
    Button.R1: 9,
    Button.L2: 10,
    Button.R2: 11,
    Button.CREATE: 12,
    Button.OPTIONS: 13,
    Button.L3: 14,
    Button.R3: 15,
    Button.PS: 16,
    Button.TOUCHPAD: 17,
    Button.MUTE: 18,
    Button.LEFT_FUNCTION: 20,
    Button.RIGHT_FUNCTION: 21,
    Button.LEFT_PADDLE: 22,
    Button.RIGHT_PADDLE: 23,
}
"""Bit of each button in the three button bytes, read as one little-endian number.

Bits 0 to 3 are the code of the directional pad."""


def _axis(byte: int) -> float:
    """Convert a stick's byte to -1 to 1: 0 to -1, 128 to 0, 255 to 1. The negative half has one step more."""
    return (byte - 128) / (127 if byte > 128 else 128)


def byte_of_axis(axis: float) -> int:
    """Return the stick's byte nearest to `axis`, -1 to 1."""
    return 128 + round(axis * (127 if axis > 0.0 else 128))


@lru_cache(maxsize=4096)
def pressed_of(code: int) -> frozenset[Button]:
    """Decode the three button bytes, given as one number; cached, as few combinations occur."""
    pressed = {button for button, bit in _BUTTON_BITS.items() if code >> bit & 1}
    hat = code & 0x0F
    return frozenset(pressed | _HAT_DIRECTIONS[hat] if hat < len(_HAT_DIRECTIONS) else pressed)


def code_of(pressed: frozenset[Button]) -> int:
    """Encode buttons as the three button bytes, in one number. pressed: without opposite directions."""
    directions = pressed & _DIRECTIONS
    code = _HAT_DIRECTIONS.index(directions) if directions else _HAT_NONE
    for button in pressed - _DIRECTIONS:
        code |= 1 << _BUTTON_BITS[button]
    return code


_BATTERY_STATES: Final = {
    0x0: BatteryState.DISCHARGING,
    0x1: BatteryState.CHARGING,
    0x2: BatteryState.FULL,
    0xA: BatteryState.OUT_OF_RANGE,
    0xB: BatteryState.TEMPERATURE,
    0xF: BatteryState.FAULT,
}
_BATTERY_CODES: Final = {state: code for code, state in _BATTERY_STATES.items()} | {BatteryState.UNKNOWN: 0x3}


@lru_cache
def _battery(byte: int) -> Battery:
    """Decode the battery's byte. Charge has steps of ten per cent; a step's middle is returned (hid-playstation)."""
    state = _BATTERY_STATES.get(byte >> 4, BatteryState.UNKNOWN)
    if state is BatteryState.FULL:
        return Battery(1.0, state)
    if state not in (BatteryState.DISCHARGING, BatteryState.CHARGING):
        return Battery(None, state)
    return Battery(min((2 * (byte & 0x0F) + 1) / 20, 1.0), state)


def _battery_byte(battery: Battery) -> int:
    """Encode the battery's byte."""
    tenths = 0 if battery.fraction is None else min(int(battery.fraction * 10 + 1e-9), 10)
    return _BATTERY_CODES[battery.state] << 4 | tenths


def parse_input_report(report: bytes) -> ControllerState:
    """Decode a full input report of either transport.

    RemoteProtocolError for another id, length or checksum, and for the simple reports with which Bluetooth starts.
    """
    start = INPUT_FRAMING[_checked_transport(report)].start
    left_x, left_y, right_x, right_y, l2, r2, _, *buttons, _, _, _, _, battery, _ = _COMMON.unpack_from(report, start)
    return ControllerState(
        left_stick=(_axis(left_x), 0.0 - _axis(left_y)),  # down is positive on the wire
        right_stick=(_axis(right_x), 0.0 - _axis(right_y)),
        l2=l2 / 255,
        r2=r2 / 255,
        pressed=pressed_of(int.from_bytes(buttons, "little")),
        battery=_battery(battery),
    )


def stamp_of(report: bytes) -> bytes | None:
    """Return what a living controller changes in full reports: number, sensor time and hands; None for other reports.

    A controller at rest still changes number and time. Of these an imitation may leave one as it is.
    """
    for framing in INPUT_FRAMING.values():
        if report[:1] == bytes((framing.report_id,)) and len(report) == framing.length:
            # The byte before the common block has another number on Bluetooth, and is constant on USB.
            start = framing.start
            return report[start - 1 : start + 10] + report[start + 27 : start + 31]
    return None


def _checked_transport(report: bytes) -> Transport:
    transport = transport_of_input(report)
    if transport is Transport.BLUETOOTH:
        if is_simple_report(report):
            raise RemoteProtocolError(
                f"input report: {described(report)}: it is of Bluetooth's simple mode; valid: a full report"
            )
        check(Seed.INPUT, report)
    return transport


def build_input_report(
    state: ControllerState, transport: Transport = Transport.USB, sequence: int = 0, sensor_time_s: float = 0.0
) -> bytes:
    """Make the full input report of a controller in `state`: 64 bytes on USB, 78 with the checksum on Bluetooth.

    Values are rounded to the report's steps. The controller lies flat, and its touchpad is not touched. sequence: 0 to
    255; one more with each report on USB, always 1 on Bluetooth (controllers wiki). sensor_time_s: time on the
    controller's clock.
    """
    framing, (left_x, left_y), (right_x, right_y) = INPUT_FRAMING[transport], state.left_stick, state.right_stick
    report = bytearray(framing.length)
    report[0] = framing.report_id
    if transport is Transport.BLUETOOTH:
        report[1] = (sequence & 0x0F) << 4 | _HAS_STATE
    _COMMON.pack_into(
        report,
        framing.start,
        *(byte_of_axis(axis) for axis in (left_x, -left_y, right_x, -right_y)),
        round(state.l2 * 255),
        round(state.r2 * 255),
        sequence,
        *code_of(state.pressed).to_bytes(3, "little"),
        _GRAVITY,
        round(sensor_time_s * _SENSOR_TICKS_PER_S) % 2**32,
        _NOT_TOUCHED,
        _NOT_TOUCHED,
        _battery_byte(state.battery),
        _USB_DATA_AND_POWER if transport is Transport.USB else 0,
    )
    return bytes(report) if transport is Transport.USB else sealed(Seed.INPUT, bytes(report[:-CHECKSUM_LENGTH]))
