"""Input reports, bytes to values and back: USB's 0x01, Bluetooth's 0x31 and its simple 0x01.

The driver reads them, the simulated controller makes them. Layout: Linux hid-playstation, SDL and the controllers
wiki, which agree. Touch, motion and the triggers' own feedback are not read, as nothing here uses them.
"""

import struct
from typing import Final

from common.errors import RemoteProtocolError
from operator_side.dualsense.reports.battery import BATTERIES, battery_byte
from operator_side.dualsense.reports.button_codes import AXIS, AXIS_DOWN, TRAVEL, byte_of_axis, code_of, pressed_of
from operator_side.dualsense.reports.checksum import CHECKSUM_LENGTH, Seed, check, sealed
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.transport import (
    INPUT_FRAMING,
    SIMPLE_REPORT_ID,
    SIMPLE_REPORT_LENGTH,
    Transport,
    is_simple_report,
    transport_of_input,
)

# Sticks 0-3, triggers 4-5, sequence 6, buttons 7-9, accelerometer's y 23-24, sensor timestamp 27-30, touch points at 32
# and 36, battery 52, sockets 53: offsets in the common block.
_COMMON: Final = struct.Struct("<7B3B13xh2xIxB3xB15xBB")
_GRAVITY: Final = 8192
_NOT_TOUCHED: Final = 0x80
_USB_DATA_AND_POWER: Final = 0x18
_SENSOR_TICKS_PER_S: Final = 3_000_000
_SIMPLE: Final = struct.Struct("<4B3B2B")
_SIMPLE_BUTTONS: Final = 0x03FFFF
"""The simple report's third byte of buttons has two of them, and a counter of six bits."""
_HAS_STATE: Final = 0x01
"""In the second byte of Bluetooth's report, below a sequence number: it holds the controller's state (wiki)."""


def parse_input_report(report: bytes) -> ControllerState:
    """Read an input report of either transport; every one of a valid id, length and checksum can be read.

    RemoteProtocolError for any other report.
    """
    transport = _checked_transport(report)
    if is_simple_report(report):
        return _parse_simple(report)
    start = INPUT_FRAMING[transport].start
    left_x, left_y, right_x, right_y, l2, r2, sequence, *buttons, _, _, _, _, battery, _ = _COMMON.unpack_from(
        report, start
    )
    return ControllerState(
        left_stick=(AXIS[left_x], AXIS_DOWN[left_y]),
        right_stick=(AXIS[right_x], AXIS_DOWN[right_y]),
        l2=TRAVEL[l2],
        r2=TRAVEL[r2],
        pressed=pressed_of(int.from_bytes(buttons, "little")),
        sequence=sequence,
        battery=BATTERIES[battery],
    )


def is_input_report(report: bytes) -> bool:
    """Whether `parse_input_report` can read it: by its id, its length and, where it has one, its checksum."""
    try:
        _checked_transport(report)
    except RemoteProtocolError:
        return False
    return True


def _checked_transport(report: bytes) -> Transport:
    transport = transport_of_input(report)
    if report[0] == INPUT_FRAMING[Transport.BLUETOOTH].report_id:
        check(Seed.INPUT, report)
    return transport


def _parse_simple(report: bytes) -> ControllerState:
    left_x, left_y, right_x, right_y, *buttons, l2, r2 = _SIMPLE.unpack_from(report, 1)
    return ControllerState(
        left_stick=(AXIS[left_x], AXIS_DOWN[left_y]),
        right_stick=(AXIS[right_x], AXIS_DOWN[right_y]),
        l2=TRAVEL[l2],
        r2=TRAVEL[r2],
        pressed=pressed_of(int.from_bytes(buttons, "little") & _SIMPLE_BUTTONS),
        sequence=buttons[2] >> 2,
        battery=None,
    )


def build_input_report(
    state: ControllerState, transport: Transport = Transport.USB, sensor_time_s: float = 0.0
) -> bytes:
    """Make the full input report of a controller in `state`, rounded to the wire's steps.

    64 bytes on USB, 78 with the checksum on Bluetooth. It lies flat, and nothing touches its pad; `sensor_time_s`: its
    own clock.
    """
    framing = INPUT_FRAMING[transport]
    report = bytearray(framing.length)
    report[0] = framing.report_id
    if transport is Transport.BLUETOOTH:
        report[1] = (state.sequence & 0x0F) << 4 | _HAS_STATE
    _COMMON.pack_into(
        report,
        framing.start,
        *_stick_bytes(state),
        round(state.l2 * 255),
        round(state.r2 * 255),
        state.sequence,
        *code_of(state.pressed).to_bytes(3, "little"),
        _GRAVITY,
        round(sensor_time_s * _SENSOR_TICKS_PER_S) % 2**32,
        _NOT_TOUCHED,
        _NOT_TOUCHED,
        0 if state.battery is None else battery_byte(state.battery),
        _USB_DATA_AND_POWER if transport is Transport.USB else 0,
    )
    return bytes(report) if transport is Transport.USB else sealed(Seed.INPUT, bytes(report[:-CHECKSUM_LENGTH]))


def build_simple_input_report(state: ControllerState) -> bytes:
    """Make the short report, 10 bytes, that Bluetooth starts with: sticks, triggers and the buttons it has."""
    code = code_of(state.pressed) & _SIMPLE_BUTTONS | (state.sequence & 0x3F) << 18
    report = bytearray(SIMPLE_REPORT_LENGTH)
    report[0] = SIMPLE_REPORT_ID
    travels = (round(state.l2 * 255), round(state.r2 * 255))
    _SIMPLE.pack_into(report, 1, *_stick_bytes(state), *code.to_bytes(3, "little"), *travels)
    return bytes(report)


def _stick_bytes(state: ControllerState) -> tuple[int, int, int, int]:
    (left_x, left_y), (right_x, right_y) = state.left_stick, state.right_stick
    return byte_of_axis(left_x), byte_of_axis(-left_y), byte_of_axis(right_x), byte_of_axis(-right_y)
