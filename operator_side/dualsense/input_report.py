"""Input reports, bytes to values and back: USB's 0x01, Bluetooth's 0x31 and its simple 0x01.

The driver reads them, the simulated controller makes them. Layout: Linux hid-playstation, SDL and the controllers
wiki, which agree.
"""

import struct
from functools import lru_cache
from typing import Final

from operator_side.dualsense.attachment_codes import (
    BATTERIES,
    CONNECTIONS,
    battery_byte,
    connections_byte,
    touch_code,
    touch_point,
)
from operator_side.dualsense.button_codes import AXIS, AXIS_DOWN, TRAVEL, byte_of_axis, code_of, pressed_of
from operator_side.dualsense.checksum import CHECKSUM_LENGTH, Seed, check, sealed
from operator_side.dualsense.controller_state import (
    SENSOR_TICKS_PER_S,
    ControllerState,
    TriggerFeedback,
    Vector3,
)
from operator_side.dualsense.motion_sensors import NOMINAL_MOTION, MotionCalibration
from operator_side.dualsense.transport import (
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
_SIMPLE: Final = struct.Struct("<4B3B2B")
_SIMPLE_BUTTONS: Final = 0x03FFFF
"""The simple report's third byte of buttons has two of them, and a counter of six bits."""
_HAS_STATE: Final = 0x01
"""In the second byte of Bluetooth's report, below a sequence number: it holds the controller's state (wiki)."""


def parse_input_report(report: bytes, motion: MotionCalibration = NOMINAL_MOTION) -> ControllerState:
    """Read an input report of either transport; every one of a valid id, length and checksum can be read.

    `motion`: the calibration that the controller holds. RemoteProtocolError for any other report.
    """
    transport = transport_of_input(report)
    if is_simple_report(report):
        return _parse_simple(report)
    if transport is Transport.BLUETOOTH:
        check(Seed.INPUT, report)
    (
        left_x, left_y, right_x, right_y, l2, r2, sequence, buttons_0, buttons_1, buttons_2,
        gyro_x, gyro_y, gyro_z, acceleration_x, acceleration_y, acceleration_z, sensor_ticks,
        touch_0, touch_1, r2_feedback, l2_feedback, active_effects, device_timestamp, battery, connections,
    ) = _COMMON.unpack_from(report, INPUT_FRAMING[transport].start)  # fmt: skip
    gyro, acceleration, zero = motion.gyro_rad_s, motion.acceleration_m_s2, motion.acceleration_zero
    return ControllerState(
        left_stick=(AXIS[left_x], AXIS_DOWN[left_y]),
        right_stick=(AXIS[right_x], AXIS_DOWN[right_y]),
        l2=TRAVEL[l2],
        r2=TRAVEL[r2],
        pressed=pressed_of(buttons_0 | buttons_1 << 8 | buttons_2 << 16),
        sequence=sequence,
        sensor_time_s=sensor_ticks / SENSOR_TICKS_PER_S,
        l2_feedback=_trigger_feedback(l2_feedback, active_effects >> 4),
        r2_feedback=_trigger_feedback(r2_feedback, active_effects & 0x0F),
        gyro_rad_s=(gyro_x * gyro[0], gyro_y * gyro[1], gyro_z * gyro[2]),
        acceleration_m_s2=(
            (acceleration_x - zero[0]) * acceleration[0],
            (acceleration_y - zero[1]) * acceleration[1],
            (acceleration_z - zero[2]) * acceleration[2],
        ),
        touches=tuple(point for point in (touch_point(touch_0), touch_point(touch_1)) if point is not None),
        battery=BATTERIES[battery],
        connections=CONNECTIONS[connections],
        device_timestamp=device_timestamp,
    )


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
def _trigger_feedback(byte: int, active_effect: int) -> TriggerFeedback:
    return TriggerFeedback(stop_location=byte & 0x0F, status=byte >> 4, active_effect=active_effect)


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
