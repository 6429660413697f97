import contextlib
import zlib
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.controller.state import Battery, BatteryState, Button, ControllerState
from operator_side.dualsense.reports.feature_report import Firmware, build_address, build_calibration, parse_address
from operator_side.dualsense.reports.input_report import build_input_report, parse_input_report
from operator_side.dualsense.reports.transport import Transport, is_simple_report, transport_of_input

TRANSPORTS = pytest.mark.parametrize("transport", Transport)
KINDS = {(0x01, 64): Transport.USB} | dict.fromkeys([(0x31, 78), (0x01, 10), (0x01, 78)], Transport.BLUETOOTH)
BLOCKS = st.binary(min_size=63, max_size=63)
FIRMWARE = Firmware(0x01020304, 0x12345678, 0x0224)


def checked(header: bytes, content: bytes) -> bytes:
    """Append to `content` the CRC-32 of `header` and `content`; the header byte itself is not sent."""
    return content + zlib.crc32(header + content).to_bytes(4, "little")


def framed(block: bytes, transport: Transport) -> bytes:
    """Build a report by hand, with the common block at the transport's offset."""
    if transport is Transport.USB:
        return b"\x01" + block
    return checked(b"\xa1", b"\x31\x01" + block + bytes(9))


def report_with(transport: Transport, **fields: int) -> bytes:
    """Build the report of an untouched controller with some bytes of the common block set; `c7` sets byte 7."""
    block = bytearray(63)
    block[0:4] = bytes([128] * 4)
    block[7] = 0x08
    block[24] = 0x20  # 8192 along y: one standard gravity
    block[32] = block[36] = 0x80
    block[52] = 0x2A
    block[53] = 0x18 if transport is Transport.USB else 0
    for name, value in fields.items():
        block[int(name[1:])] = value
    return framed(bytes(block), transport)


@TRANSPORTS
def test_exact_bytes_of_an_idle_report(transport: Transport) -> None:
    assert parse_input_report(report_with(transport)) == ControllerState()
    clock = {"c27": 0xC0, "c28": 0xC6, "c29": 0x2D}  # 3 000 000 thirds of a microsecond
    number = 17 if transport is Transport.USB else 0  # On Bluetooth the number is in the framing, too.
    expected = report_with(transport, c6=number, **clock)
    assert build_input_report(ControllerState(), transport, number, sensor_time_s=1.0) == expected


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
        ({"c6": 200}, {}),
        ({"c52": 0x00}, {"battery": Battery(0.05, BatteryState.DISCHARGING)}),
        ({"c52": 0x19}, {"battery": Battery(0.95, BatteryState.CHARGING)}),
        ({"c52": 0x0A}, {"battery": Battery(1.0, BatteryState.DISCHARGING)}),
        ({"c52": 0x2A}, {"battery": Battery(1.0, BatteryState.FULL)}),
        ({"c52": 0xA5}, {"battery": Battery(None, BatteryState.OUT_OF_RANGE)}),
        ({"c52": 0xB0}, {"battery": Battery(None, BatteryState.TEMPERATURE)}),
        ({"c52": 0xF0}, {"battery": Battery(None, BatteryState.FAULT)}),
        ({"c52": 0x50}, {"battery": Battery(None, BatteryState.UNKNOWN)}),
        *(
            ({f"c{place}": bits}, {"pressed": frozenset({button})})
            for place, bits, button in (
                *((7, 0x18, Button.SQUARE), (7, 0x28, Button.CROSS), (7, 0x48, Button.CIRCLE)),
                *((7, 0x88, Button.TRIANGLE), (8, 0x01, Button.L1), (8, 0x02, Button.R1), (8, 0x04, Button.L2)),
                *((8, 0x08, Button.R2), (8, 0x10, Button.CREATE), (8, 0x20, Button.OPTIONS), (8, 0x40, Button.L3)),
                *((8, 0x80, Button.R3), (9, 0x01, Button.PS), (9, 0x02, Button.TOUCHPAD), (9, 0x04, Button.MUTE)),
                *((9, 0x10, Button.LEFT_FUNCTION), (9, 0x20, Button.RIGHT_FUNCTION)),
                *((9, 0x40, Button.LEFT_PADDLE), (9, 0x80, Button.RIGHT_PADDLE)),
            )
        ),
        *(
            ({"c7": hat}, {"pressed": frozenset(pressed)})
            for hat, pressed in (
                *((0, {Button.UP}), (1, {Button.UP, Button.RIGHT}), (2, {Button.RIGHT})),
                *((3, {Button.RIGHT, Button.DOWN}), (4, {Button.DOWN}), (5, {Button.DOWN, Button.LEFT})),
                *((6, {Button.LEFT}), (7, {Button.LEFT, Button.UP}), (8, set()), (15, set())),
            )
        ),
    ],
)
def test_each_field_has_its_byte(transport: Transport, fields: dict[str, int], expected: dict[str, Any]) -> None:
    assert parse_input_report(report_with(transport, **fields)) == ControllerState(**expected)


@TRANSPORTS
@given(block=BLOCKS)
def test_every_input_report_survives_a_round_trip(transport: Transport, block: bytes) -> None:
    state = parse_input_report(framed(block, transport))
    report = build_input_report(state, transport, block[6])
    assert parse_input_report(report) == state
    start = 1 if transport is Transport.USB else 2
    built = report[start : start + 63]
    # Bytes are equal where each value has only one encoding: not for the hat's null states and undefined bits.
    assert built[0:7] == block[0:7]
    assert built[7] & 0xF0 == block[7] & 0xF0
    assert built[8] == block[8]
    assert built[9] == block[9] & 0xF7


@given(st.tuples(*[st.floats(-1, 1)] * 4), st.tuples(*[st.floats(0, 1)] * 2))
def test_building_rounds_to_the_nearest_step(sticks: tuple[float, ...], triggers: tuple[float, ...]) -> None:
    state = ControllerState((sticks[0], sticks[1]), (sticks[2], sticks[3]), triggers[0], triggers[1])
    read = parse_input_report(build_input_report(state))
    assert [*read.left_stick, *read.right_stick] == pytest.approx(sticks, abs=0.5 / 127 + 1e-12)
    assert [read.l2, read.r2] == pytest.approx(triggers, abs=0.5 / 255 + 1e-12)


@given(st.sampled_from([0x01, 0x31, 0x02]), st.sampled_from([0, 1, 9, 10, 63, 64, 77, 78, 79]), st.randoms())
@settings(max_examples=1000)
def test_any_bytes_parse_or_raise_the_documented_error(report_id: int, length: int, random: Any) -> None:
    report = (bytes([report_id]) + random.randbytes(130))[:length]
    transport = KINDS.get((report_id, length))
    if transport is None:
        found = f"id 0x{report_id:02x}, {length} bytes;" if length else "no bytes;"
        with pytest.raises(RemoteProtocolError, match=found):
            transport_of_input(report)
    else:
        assert transport_of_input(report) is transport
        assert is_simple_report(report) is ((report_id, length) in ((0x01, 10), (0x01, 78)))
    with contextlib.suppress(RemoteProtocolError):
        parse_input_report(report)
        assert transport is not None


@given(BLOCKS, st.integers(0, 78 * 8 - 1))
def test_a_bluetooth_report_with_a_wrong_bit_is_refused(block: bytes, bit: int) -> None:
    report = bytearray(framed(block, Transport.BLUETOOTH))
    report[bit // 8] ^= 1 << bit % 8
    with pytest.raises(RemoteProtocolError, match="checksum" if bit >= 8 else "id 0x"):
        parse_input_report(bytes(report))


@TRANSPORTS
def test_exact_bytes_of_features(transport: Transport) -> None:
    motion = "0000 0000 0000" + "c021 40de" * 3 + "1c02 1c02" + "0020 00e0" * 3
    for report_id, length, content, built in (
        (0x05, 41, motion, build_calibration(transport)),
        (0x09, 20, "ff ee dd cc bb aa", build_address("aa:bb:cc:dd:ee:ff", transport)),
        (0x20, 64, "00" * 23 + "04 03 02 01 78 56 34 12" + "00" * 12 + "24 02", FIRMWARE.build(transport)),
    ):
        expected = bytes([report_id]) + bytes.fromhex(content)
        if transport is Transport.USB:
            assert built == expected.ljust(length, b"\0")
        else:
            assert built == checked(b"\xa3", expected.ljust(length - 4, b"\0"))
    assert parse_address(build_address("aa:bb:cc:dd:ee:ff", transport), transport) == "aa:bb:cc:dd:ee:ff"
    assert Firmware.parse(FIRMWARE.build(transport), transport) == FIRMWARE


@pytest.mark.parametrize(
    ("report", "transport", "message"),
    [
        (b"", Transport.USB, "no bytes; valid: id 0x20, 64 bytes"),
        (bytes([0x20]) + bytes(62), Transport.USB, "id 0x20, 63 bytes; valid: id 0x20, 64 bytes"),
        (build_address("00:00:00:00:00:01"), Transport.USB, "id 0x09, 20 bytes; valid: id 0x20, 64 bytes"),
        (FIRMWARE.build(Transport.USB), Transport.BLUETOOTH, "feature report: checksum"),
    ],
)
def test_refused_features_are_named(report: bytes, transport: Transport, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        Firmware.parse(report, transport)


@pytest.mark.parametrize(
    ("kind", "arguments", "message"),
    [
        (ControllerState, ((0.0, 0.0), (0.0, 0.0), 0.0, 0.0, frozenset({Button.UP, Button.DOWN})), "down and up"),
        (build_address, ("aa:bb:cc:dd:ee",), "address = 'aa:bb:cc:dd:ee'; valid: six pairs"),
        (build_address, ("AA:BB:CC:DD:EE:FF",), "address = "),
        (build_address, ("aa:bb:cc:dd:ee:ff\n",), "address = "),
        (build_address, (5,), "address = 5"),
    ],
)
def test_refused_values_are_named(kind: Any, arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        kind(*arguments)
