"""Feature reports: their fields in their places, on both transports."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.reports.checksum import Seed, sealed
from operator_side.dualsense.reports.feature_report import (
    CalibrationReport,
    Firmware,
    build_address,
    parse_address,
)
from operator_side.dualsense.reports.transport import Transport

REPEATABLE = settings(derandomize=True, deadline=None)
TRANSPORTS = pytest.mark.parametrize("transport", Transport)
COUNTS = st.integers(-32768, 32767)
THREE = st.tuples(COUNTS, COUNTS, COUNTS)


def finished(content: bytes, length: int, transport: Transport) -> bytes:
    """A report by hand: padded with zeros, and with its checksum on Bluetooth."""
    if transport is Transport.USB:
        return content.ljust(length, b"\0")
    return sealed(Seed.FEATURE, content.ljust(length - 4, b"\0"))


@TRANSPORTS
def test_the_address_by_hand(transport: Transport) -> None:
    report = finished(bytes.fromhex("09 ff ee dd cc bb aa"), 20, transport)
    assert parse_address(report, transport) == "aa:bb:cc:dd:ee:ff"
    assert build_address("aa:bb:cc:dd:ee:ff", transport) == report


@TRANSPORTS
def test_the_firmware_by_hand(transport: Transport) -> None:
    content = bytearray(46)
    content[0] = 0x20
    content[24:32] = bytes.fromhex("04 03 02 01 78 56 34 12")
    content[44:46] = bytes.fromhex("24 02")
    report = finished(bytes(content), 64, transport)
    assert Firmware.parse(report, transport) == Firmware(0x01020304, 0x12345678, 0x0224)
    assert Firmware(0x01020304, 0x12345678, 0x0224).build(transport) == report


@TRANSPORTS
def test_the_calibration_by_hand(transport: Transport) -> None:
    content = bytes([0x05]) + b"".join(value.to_bytes(2, "little", signed=True) for value in range(-8, 9))
    report = finished(content, 41, transport)
    expected = CalibrationReport(
        gyro_bias=(-8, -7, -6),
        gyro_plus=(-5, -3, -1),
        gyro_minus=(-4, -2, 0),
        speed_plus=1,
        speed_minus=2,
        acceleration_plus=(3, 5, 7),
        acceleration_minus=(4, 6, 8),
    )
    assert CalibrationReport.parse(report, transport) == expected
    assert expected.build(transport) == report


@TRANSPORTS
@given(measured=st.builds(CalibrationReport, THREE, THREE, THREE, COUNTS, COUNTS, THREE, THREE))
@REPEATABLE
def test_every_calibration_survives_a_round_trip(transport: Transport, measured: CalibrationReport) -> None:
    assert CalibrationReport.parse(measured.build(transport), transport) == measured


@pytest.mark.parametrize("length", [0, 1, 19, 21, 64])
def test_another_length_is_named(length: int) -> None:
    with pytest.raises(RemoteProtocolError, match=f"{length} bytes; valid: id 0x09, 20 bytes|no bytes"):
        parse_address((b"\x09" + bytes(80))[:length])


def test_another_id_is_named() -> None:
    with pytest.raises(RemoteProtocolError, match="id 0x09, 20 bytes; valid: id 0x20, 64 bytes"):
        Firmware.parse(build_address("00:00:00:00:00:01"))


@pytest.mark.parametrize("place", [0, 3, 37])
def test_a_wrong_checksum_counts_on_bluetooth_only(place: int) -> None:
    zeros = CalibrationReport((0, 0, 0), (0, 0, 0), (0, 0, 0), 0, 0, (0, 0, 0), (0, 0, 0))
    report = bytearray(zeros.build(Transport.BLUETOOTH))
    assert CalibrationReport.parse(bytes(report), Transport.USB) == zeros
    report[place] ^= 1
    with pytest.raises(RemoteProtocolError, match=r"checksum|id 0x04"):
        CalibrationReport.parse(bytes(report), Transport.BLUETOOTH)


@pytest.mark.parametrize(
    "address", ["", "aa:bb:cc:dd:ee", "AA:BB:CC:DD:EE:FF", "aa-bb-cc-dd-ee-ff", "aa:bb:cc:dd:ee:ff\n"]
)
def test_a_strange_address_is_not_built(address: str) -> None:
    with pytest.raises(ValueError, match="address = "):
        build_address(address)


def test_values_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match="update_version = 65536"):
        Firmware(0, 0, 65536)
    with pytest.raises(ValueError, match=r"gyro_plus\[1\] = 40000"):
        CalibrationReport((0, 0, 0), (0, 40_000, 0), (0, 0, 0), 0, 0, (0, 0, 0), (0, 0, 0))
    with pytest.raises(ValueError, match=r"hardware_version = 0\.5; valid: an integer"):
        Firmware(0.5, 0, 0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"gyro_bias\[1\] = 0.5"):
        CalibrationReport((0, 0.5, 0), (0, 0, 0), (0, 0, 0), 0, 0, (0, 0, 0), (0, 0, 0))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"speed_plus = 0\.5"):
        CalibrationReport((0, 0, 0), (0, 0, 0), (0, 0, 0), 0.5, 0, (0, 0, 0), (0, 0, 0))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="speed_minus = 32768"):
        CalibrationReport((0, 0, 0), (0, 0, 0), (0, 0, 0), 0, 32768, (0, 0, 0), (0, 0, 0))
