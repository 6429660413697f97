"""Input reports, bytes to values and back: USB's 0x01, Bluetooth's 0x31 and its simple 0x01.

The driver reads them, the simulated controller makes them. Layout: Linux hid-playstation, SDL and the controllers
wiki, which agree.
"""

import struct
from dataclasses import fields
from functools import lru_cache, partial
from typing import Final

from operator_side.dualsense.reports.attachment_codes import (
    BATTERIES,
    CONNECTIONS,
    NOT_TOUCHED,
    battery_byte,
    connections_byte,
    touch_code,
    touch_point,
)
from operator_side.dualsense.reports.attachments import TouchPoint
from operator_side.dualsense.reports.button_codes import AXIS, AXIS_DOWN, TRAVEL, byte_of_axis, code_of, pressed_of
from operator_side.dualsense.reports.checksum import CHECKSUM_LENGTH, Seed, check, is_sealed, sealed
from operator_side.dualsense.reports.controller_state import (
    SENSOR_TICKS_PER_S,
    ControllerState,
    TriggerFeedback,
    Vector3,
)
from operator_side.dualsense.reports.motion_sensors import NOMINAL_MOTION, MotionCalibration
from operator_side.dualsense.reports.transport import (
    INPUT_FRAMING,
    SIMPLE_REPORT_ID,
    SIMPLE_REPORT_LENGTH,
    Transport,
    is_simple_report,
    transport_of_input,
)

# Sticks 0-3, triggers 4-5, sequence 6, buttons 7-9, counter 11-14, gyroscope 15-20, accelerometer 21-26, sensor
# timestamp 27-30, touch points 32-39, trigger feedback 41-42 (R2 first), active effects 47, device timestamp
# 48-51, battery 52, sockets 53: offsets in the common block.
_COMMON: Final = struct.Struct("<7B3B5x3h3hIxIIxBB4xBIBB")
_unpack: Final = _COMMON.unpack_from
_USB, _BLUETOOTH = INPUT_FRAMING[Transport.USB], INPUT_FRAMING[Transport.BLUETOOTH]
_USB_ID, _USB_LENGTH, _USB_START = _USB.report_id, _USB.length, _USB.start
_BLUETOOTH_ID, _BLUETOOTH_LENGTH, _BLUETOOTH_START = _BLUETOOTH.report_id, _BLUETOOTH.length, _BLUETOOTH.start
_SIMPLE: Final = struct.Struct("<4B3B2B")
_SIMPLE_BUTTONS: Final = 0x03FFFF
"""The simple report's third byte of buttons has two of them, and a counter of six bits."""
_HAS_STATE: Final = 0x01
"""In the second byte of Bluetooth's report, below a sequence number: it holds the controller's state (wiki)."""


_new_state: Final = partial(object.__new__, ControllerState)
(
    _set_left_stick, _set_right_stick, _set_l2, _set_r2, _set_pressed, _set_sequence, _set_sensor_time,
    _set_l2_feedback, _set_r2_feedback, _set_gyro, _set_acceleration, _set_touches, _set_battery, _set_connections,
    _set_device_timestamp,
) = (vars(ControllerState)[part.name].__set__ for part in fields(ControllerState))  # fmt: skip
"""Every report passes here, and every value comes from a table or has few bits: nothing is left to be validated."""


def parse_input_report(report: bytes, motion: MotionCalibration = NOMINAL_MOTION) -> ControllerState:
    """Read an input report of either transport; every one of a valid id, length and checksum can be read.

    `motion`: the calibration that the controller holds. RemoteProtocolError for any other report.
    """
    length = len(report)
    if length == _USB_LENGTH and report[0] == _USB_ID:
        start = _USB_START
    elif length == _BLUETOOTH_LENGTH and report[0] == _BLUETOOTH_ID:
        check(Seed.INPUT, report)
        start = _BLUETOOTH_START
    else:
        transport_of_input(report)  # or it is none
        return _parse_simple(report)
    (
        left_x, left_y, right_x, right_y, l2, r2, sequence, buttons_0, buttons_1, buttons_2,
        gyro_x, gyro_y, gyro_z, acceleration_x, acceleration_y, acceleration_z, sensor_ticks,
        touch_0, touch_1, r2_feedback, l2_feedback, active_effects, device_timestamp, battery, connections,
    ) = _unpack(report, start)  # fmt: skip
    gyro_scale_x, gyro_scale_y, gyro_scale_z = motion.gyro_rad_s
    scale_x, scale_y, scale_z = motion.acceleration_m_s2
    zero_x, zero_y, zero_z = motion.acceleration_zero
    state = _new_state()
    _set_left_stick(state, (AXIS[left_x], AXIS_DOWN[left_y]))
    _set_right_stick(state, (AXIS[right_x], AXIS_DOWN[right_y]))
    _set_l2(state, TRAVEL[l2])
    _set_r2(state, TRAVEL[r2])
    _set_pressed(state, pressed_of(buttons_0 | buttons_1 << 8 | buttons_2 << 16))
    _set_sequence(state, sequence)
    _set_sensor_time(state, sensor_ticks / SENSOR_TICKS_PER_S)
    _set_l2_feedback(state, _trigger_feedback(l2_feedback | (active_effects & 0xF0) << 4))
    _set_r2_feedback(state, _trigger_feedback(r2_feedback | (active_effects & 0x0F) << 8))
    _set_gyro(state, (gyro_x * gyro_scale_x, gyro_y * gyro_scale_y, gyro_z * gyro_scale_z))
    _set_acceleration(
        state,
        (
            (acceleration_x - zero_x) * scale_x,
            (acceleration_y - zero_y) * scale_y,
            (acceleration_z - zero_z) * scale_z,
        ),
    )
    _set_touches(state, () if touch_0 & touch_1 & NOT_TOUCHED else _touches(touch_0, touch_1))
    _set_battery(state, BATTERIES[battery])
    _set_connections(state, CONNECTIONS[connections])
    _set_device_timestamp(state, device_timestamp)
    return state


def is_input_report(report: bytes) -> bool:
    """Whether `parse_input_report` can read it: by its id, its length and, where it has one, its checksum."""
    length = len(report)
    if length == _USB_LENGTH and report[0] == _USB_ID:
        return True
    if length == _BLUETOOTH_LENGTH and report[0] == _BLUETOOTH_ID:
        return is_sealed(Seed.INPUT, report)
    return is_simple_report(report)


def _touches(first: int, second: int) -> tuple[TouchPoint, ...]:
    """One finger or two: at least one of the codes has one."""
    if first & NOT_TOUCHED:
        return (touch_point(second),)
    return (touch_point(first),) if second & NOT_TOUCHED else (touch_point(first), touch_point(second))


def _parse_simple(report: bytes) -> ControllerState:
    left_x, left_y, right_x, right_y, buttons_0, buttons_1, buttons_2, l2, r2 = _SIMPLE.unpack_from(report, 1)
    return ControllerState(
        left_stick=(AXIS[left_x], AXIS_DOWN[left_y]),
        right_stick=(AXIS[right_x], AXIS_DOWN[right_y]),
        l2=TRAVEL[l2],
        r2=TRAVEL[r2],
        pressed=pressed_of((buttons_0 | buttons_1 << 8 | buttons_2 << 16) & _SIMPLE_BUTTONS),
        sequence=buttons_2 >> 2,
        sensor_time_s=None,
        l2_feedback=None,
        r2_feedback=None,
        gyro_rad_s=None,
        acceleration_m_s2=None,
        touches=None,
        battery=None,
        connections=None,
        device_timestamp=None,
    )


@lru_cache(maxsize=4096)
def _trigger_feedback(code: int) -> TriggerFeedback:
    """Three nibbles: from the lowest on the stop location, the status and the active effect."""
    return TriggerFeedback(stop_location=code & 0x0F, status=code >> 4 & 0x0F, active_effect=code >> 8)


def build_input_report(
    state: ControllerState, transport: Transport = Transport.USB, motion: MotionCalibration = NOMINAL_MOTION
) -> bytes:
    """Make the full input report of a controller in `state`, rounded to the wire's steps.

    64 bytes on USB, 78 with the checksum on Bluetooth. The bits of what is None are 0, as `ControllerState` has
    no more to say: nothing touches the pad, the motion sensors stand at 0.
    """
    framing = INPUT_FRAMING[transport]
    report = bytearray(framing.length)
    report[0] = framing.report_id
    if transport is Transport.BLUETOOTH:
        report[1] = (state.sequence & 0x0F) << 4 | _HAS_STATE
    code = code_of(state.pressed)
    l2, r2 = state.l2_feedback or TriggerFeedback(), state.r2_feedback or TriggerFeedback()
    still: Vector3 = (0.0, 0.0, 0.0)
    gyro = motion.gyro_counts(state.gyro_rad_s or still)
    acceleration = (0, 0, 0) if state.acceleration_m_s2 is None else motion.acceleration_counts(state.acceleration_m_s2)
    first, second = (*(state.touches or ()), None, None)[:2]
    _COMMON.pack_into(
        report,
        framing.start,
        *_stick_bytes(state),
        round(state.l2 * 255),
        round(state.r2 * 255),
        state.sequence,
        *code.to_bytes(3, "little"),
        *gyro,
        *acceleration,
        round((state.sensor_time_s or 0.0) * SENSOR_TICKS_PER_S) % 2**32,
        touch_code(first),
        touch_code(second),
        r2.status << 4 | r2.stop_location,
        l2.status << 4 | l2.stop_location,
        l2.active_effect << 4 | r2.active_effect,
        state.device_timestamp or 0,
        0 if state.battery is None else battery_byte(state.battery),
        0 if state.connections is None else connections_byte(state.connections),
    )
    return sealed(Seed.INPUT, bytes(report[:-CHECKSUM_LENGTH])) if transport is Transport.BLUETOOTH else bytes(report)


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
