"""Input reports: every field in its place on both transports, round trips, one error for all that is no report."""

from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.reports.attachments import Battery, BatteryState, Connections, TouchPoint
from operator_side.dualsense.reports.checksum import Seed, sealed
from operator_side.dualsense.reports.controller_state import Button, ControllerState, TriggerFeedback
from operator_side.dualsense.reports.input_report import (
    build_input_report,
    build_simple_input_report,
    is_input_report,
    parse_input_report,
)
from operator_side.dualsense.reports.transport import Transport

REPEATABLE = settings(derandomize=True, deadline=None)
COMMON_BLOCKS = st.binary(min_size=63, max_size=63)
TRANSPORTS = pytest.mark.parametrize("transport", Transport)


def framed(block: bytes, transport: Transport) -> bytes:
    """A report by hand, with the common block in its place."""
    if transport is Transport.USB:
        return b"\x01" + block
    return sealed(Seed.INPUT, b"\x31\x01" + block + bytes(9))


def report_with(transport: Transport, **fields: int) -> bytes:
    """The report of an idle controller with bytes of the common block set: `c7=0x28` is byte 7."""
    block = bytearray(63)
    block[0:4] = bytes([128] * 4)
    block[7] = 0x08
    block[24] = 0x20  # 8192 along y: one standard gravity
    block[32] = block[36] = 0x80
    block[52] = 0x2A
    block[53] = 0x18
    for name, value in fields.items():
        block[int(name[1:])] = value
    return framed(bytes(block), transport)


@TRANSPORTS
def test_idle_report(transport: Transport) -> None:
    assert parse_input_report(report_with(transport)) == ControllerState()
    assert build_input_report(ControllerState(), transport) == report_with(transport)


@TRANSPORTS
@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"c0": 255}, {"left_stick": (1.0, 0.0)}),
        ({"c0": 0}, {"left_stick": (-1.0, 0.0)}),
        ({"c1": 0}, {"left_stick": (0.0, 1.0)}),
        ({"c1": 255}, {"left_stick": (0.0, -1.0)}),
        ({"c2": 64}, {"right_stick": (-0.5, 0.0)}),
        ({"c3": 64}, {"right_stick": (0.0, 0.5)}),
        ({"c4": 255}, {"l2": 1.0}),
        ({"c5": 51}, {"r2": 0.2}),
        ({"c6": 200}, {"sequence": 200}),
        ({"c27": 0xC0, "c28": 0xC6, "c29": 0x2D}, {"sensor_time_s": 1.0}),  # 3 000 000 thirds of a microsecond
        ({"c41": 0x19, "c47": 0x01}, {"r2_feedback": TriggerFeedback(9, 1, 1)}),
        ({"c42": 0x03, "c47": 0x20}, {"l2_feedback": TriggerFeedback(3, 0, 2)}),
        # Finger 5 at x = 0x123, y = 0x456: its twelve bits each are interleaved by nibbles.
        ({"c32": 0x05, "c33": 0x23, "c34": 0x61, "c35": 0x45}, {"touches": (TouchPoint(5, 0x123, 0x456),)}),
        ({"c36": 0x7F, "c37": 0x7F, "c38": 0x77, "c39": 0x43}, {"touches": (TouchPoint(127, 1919, 1079),)}),
        ({"c48": 0x78, "c49": 0x56, "c50": 0x34, "c51": 0x12}, {"device_timestamp": 0x12345678}),
        ({"c52": 0x00}, {"battery": Battery(0.05, BatteryState.DISCHARGING)}),
        ({"c52": 0x19}, {"battery": Battery(0.95, BatteryState.CHARGING)}),
        ({"c52": 0x0A}, {"battery": Battery(1.0, BatteryState.DISCHARGING)}),
        ({"c52": 0x2A}, {"battery": Battery(1.0, BatteryState.FULL)}),
        ({"c52": 0xA5}, {"battery": Battery(None, BatteryState.OUT_OF_RANGE)}),
        ({"c52": 0xB0}, {"battery": Battery(None, BatteryState.TEMPERATURE)}),
        ({"c52": 0xF0}, {"battery": Battery(None, BatteryState.FAULT)}),
        ({"c52": 0x50}, {"battery": Battery(None, BatteryState.UNKNOWN)}),
        ({"c53": 0x01}, {"connections": Connections(True, False, False, False, False)}),
        ({"c53": 0x02}, {"connections": Connections(False, True, False, False, False)}),
        ({"c53": 0x04}, {"connections": Connections(False, False, True, False, False)}),
        ({"c53": 0x08}, {"connections": Connections(False, False, False, True, False)}),
        ({"c53": 0x10}, {"connections": Connections(False, False, False, False, True)}),
    ],
)
def test_each_field_has_its_byte(transport: Transport, fields: dict[str, int], expected: dict[str, Any]) -> None:
    assert parse_input_report(report_with(transport, **fields)) == ControllerState(**expected)


@TRANSPORTS
@pytest.mark.parametrize("axis", range(3))
def test_the_motion_sensors_have_their_bytes(transport: Transport, axis: int) -> None:
    turning = parse_input_report(report_with(transport, **{f"c{15 + 2 * axis}": 0xA0})).gyro_rad_s
    assert turning is not None
    assert turning[axis] == pytest.approx(10.0 * 3.141592653589793 / 180.0, rel=1e-12)  # 160 counts, 16 a degree/s
    assert [turning[other] for other in range(3) if other != axis] == [0.0, 0.0]
    pushed = parse_input_report(report_with(transport, **{"c24": 0, f"c{22 + 2 * axis}": 0xE0})).acceleration_m_s2
    assert pushed is not None
    assert pushed[axis] == -9.80665
    assert [pushed[other] for other in range(3) if other != axis] == [0.0, 0.0]


@TRANSPORTS
@pytest.mark.parametrize(
    ("fields", "button"),
    [
        ({"c7": 0x18}, Button.SQUARE),
        ({"c7": 0x28}, Button.CROSS),
        ({"c7": 0x48}, Button.CIRCLE),
        ({"c7": 0x88}, Button.TRIANGLE),
        ({"c8": 0x01}, Button.L1),
        ({"c8": 0x02}, Button.R1),
        ({"c8": 0x04}, Button.L2),
        ({"c8": 0x08}, Button.R2),
        ({"c8": 0x10}, Button.CREATE),
        ({"c8": 0x20}, Button.OPTIONS),
        ({"c8": 0x40}, Button.L3),
        ({"c8": 0x80}, Button.R3),
        ({"c9": 0x01}, Button.PS),
        ({"c9": 0x02}, Button.TOUCHPAD),
        ({"c9": 0x04}, Button.MUTE),
        ({"c9": 0x10}, Button.LEFT_FUNCTION),
        ({"c9": 0x20}, Button.RIGHT_FUNCTION),
        ({"c9": 0x40}, Button.LEFT_PADDLE),
        ({"c9": 0x80}, Button.RIGHT_PADDLE),
    ],
)
def test_each_button_has_its_bit(transport: Transport, fields: dict[str, int], button: Button) -> None:
    assert parse_input_report(report_with(transport, **fields)).pressed == {button}


@pytest.mark.parametrize(
    ("hat", "pressed"),
    [
        (0, {Button.UP}),
        (1, {Button.UP, Button.RIGHT}),
        (2, {Button.RIGHT}),
        (3, {Button.RIGHT, Button.DOWN}),
        (4, {Button.DOWN}),
        (5, {Button.DOWN, Button.LEFT}),
        (6, {Button.LEFT}),
        (7, {Button.LEFT, Button.UP}),
        (8, set()),
        (15, set()),
    ],
)
def test_hat_goes_clockwise_from_up(hat: int, pressed: set[Button]) -> None:
    assert parse_input_report(report_with(Transport.USB, c7=hat)).pressed == pressed


@TRANSPORTS
@given(block=COMMON_BLOCKS)
@REPEATABLE
def test_every_input_report_survives_a_round_trip(transport: Transport, block: bytes) -> None:
    state = parse_input_report(framed(block, transport))
    report = build_input_report(state, transport)
    assert parse_input_report(report) == state
    start = 1 if transport is Transport.USB else 2
    built = report[start : start + 63]
    # All that has one encoding is the very same bytes: not the hat's null states and the undefined bits.
    assert built[0:7] == block[0:7]
    assert built[7] & 0xF0 == block[7] & 0xF0
    assert built[8] == block[8]
    assert built[9] == block[9] & 0xF7
    assert built[15:31] == block[15:31]
    assert built[41:43] == block[41:43]
    assert built[47:52] == block[47:52]
    assert built[53] == block[53] & 0x1F


@given(
    st.tuples(*[st.floats(-1, 1)] * 4),
    st.tuples(*[st.floats(0, 1)] * 2),
    st.floats(0, 1431.6),
    st.tuples(*[st.floats(-35.0, 35.0)] * 3),
)
@REPEATABLE
def test_building_rounds_to_the_nearest_step(
    sticks: tuple[float, ...], triggers: tuple[float, ...], time_s: float, turning: tuple[float, float, float]
) -> None:
    state = ControllerState(
        (sticks[0], sticks[1]),
        (sticks[2], sticks[3]),
        triggers[0],
        triggers[1],
        sensor_time_s=time_s,
        gyro_rad_s=turning,
    )
    read = parse_input_report(build_input_report(state))
    assert [*read.left_stick, *read.right_stick] == pytest.approx(sticks, abs=0.5 / 127 + 1e-12)
    assert [read.l2, read.r2] == pytest.approx(triggers, abs=0.5 / 255 + 1e-12)
    assert read.sensor_time_s == pytest.approx(time_s, abs=0.5 / 3e6 + 1e-12)
    assert read.gyro_rad_s == pytest.approx(turning, abs=0.5 / 16 * 3.1416 / 180)


def test_the_simple_report_by_hand() -> None:
    report = bytes([0x01, 255, 128, 64, 0, 0x28, 0x09, 0x02 | 37 << 2, 51, 255])
    expected = ControllerState(
        left_stick=(1.0, 0.0),
        right_stick=(-0.5, 1.0),
        l2=0.2,
        r2=1.0,
        pressed=frozenset({Button.CROSS, Button.L1, Button.R2, Button.TOUCHPAD}),
        sequence=37,
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
    assert parse_input_report(report) == expected
    assert parse_input_report(report + bytes(68)) == expected  # as some systems pad it
    assert build_simple_input_report(expected) == report


@given(st.binary(min_size=9, max_size=9))
@REPEATABLE
def test_every_simple_report_survives_a_round_trip(rest: bytes) -> None:
    state = parse_input_report(b"\x01" + rest)
    built = build_simple_input_report(state)
    assert parse_input_report(built) == state
    assert built[1:5] == rest[0:4]
    assert built[6:] == rest[5:]


def test_a_full_report_of_a_state_that_says_little() -> None:
    state = parse_input_report(bytes([0x01, 128, 128, 128, 128, 8, 0, 0, 0, 0]))
    read = parse_input_report(build_input_report(state, Transport.BLUETOOTH))
    assert read.touches == ()
    assert read.gyro_rad_s == read.acceleration_m_s2 == (0.0, 0.0, 0.0)


@given(st.binary(max_size=130))
@REPEATABLE
def test_any_bytes_parse_or_raise_the_documented_error(report: bytes) -> None:
    try:
        parse_input_report(report)
    except RemoteProtocolError:
        return
    assert (report[0], len(report)) in ((0x01, 64), (0x31, 78), (0x01, 10), (0x01, 78))


@given(COMMON_BLOCKS, st.integers(0, 63))
@REPEATABLE
def test_a_truncated_input_report_names_its_length(block: bytes, length: int) -> None:
    report = framed(block, Transport.USB)[:length]
    if length == 10:  # it happens to be as long as a simple one
        parse_input_report(report)
        return
    with pytest.raises(RemoteProtocolError, match=f"{length} bytes;" if length else "no bytes;"):
        parse_input_report(report)


@given(COMMON_BLOCKS, st.integers(0, 78 * 8 - 1))
@REPEATABLE
def test_a_bluetooth_report_with_a_wrong_bit_is_refused(block: bytes, bit: int) -> None:
    report = bytearray(framed(block, Transport.BLUETOOTH))
    report[bit // 8] ^= 1 << bit % 8
    with pytest.raises(RemoteProtocolError, match="checksum" if bit >= 8 else "id 0x"):
        parse_input_report(bytes(report))


@given(
    st.sampled_from([b"\x01", b"\x31", b"\x02", b""]),
    st.sampled_from([0, 9, 10, 63, 64, 77]),
    st.randoms(),
    st.booleans(),
)
@REPEATABLE
def test_what_can_be_parsed_is_known_without_parsing(
    report_id: bytes, length: int, random: Random, with_checksum: bool
) -> None:
    report = report_id + random.randbytes(length)
    if with_checksum and length > 4:
        report = sealed(Seed.INPUT, report[:-4])
    try:
        parse_input_report(report)
    except RemoteProtocolError:
        assert not is_input_report(report)
    else:
        assert is_input_report(report)
