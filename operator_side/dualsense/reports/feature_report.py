"""Feature reports, which are read once: calibration (0x05), address (0x09), firmware (0x20).

On Bluetooth their last four bytes are a checksum. Layout: Linux hid-playstation and the controllers wiki.
"""

import struct
from dataclasses import dataclass
from typing import Final, Self

from common.checks import check_integer, check_integers
from common.errors import RemoteProtocolError
from operator_side.dualsense.reports.address import checked_address
from operator_side.dualsense.reports.checksum import CHECKSUM_LENGTH, Seed, check, sealed
from operator_side.dualsense.reports.transport import Transport, described

CALIBRATION_ID: Final = 0x05
ADDRESS_ID: Final = 0x09
FIRMWARE_ID: Final = 0x20
FEATURE_LENGTHS: Final = {CALIBRATION_ID: 41, ADDRESS_ID: 20, FIRMWARE_ID: 64}
"""In bytes, with the id."""

_CALIBRATION: Final = struct.Struct("<17h")
_HARDWARE, _FIRMWARE, _UPDATE = 24, 28, 44

Three = tuple[int, int, int]


def _checked(report: bytes, report_id: int, transport: Transport) -> bytes:
    length = FEATURE_LENGTHS[report_id]
    if len(report) != length or report[0] != report_id:
        raise RemoteProtocolError(f"feature report: {described(report)}; valid: id 0x{report_id:02x}, {length} bytes")
    if transport is Transport.BLUETOOTH:
        check(Seed.FEATURE, report)
    return report


def _finished(report: bytearray, transport: Transport) -> bytes:
    if transport is Transport.USB:
        return bytes(report)
    return sealed(Seed.FEATURE, bytes(report[:-CHECKSUM_LENGTH]))


@dataclass(frozen=True, slots=True)
class CalibrationReport:
    """What the factory measured of the motion sensors: what they said, in units of 16 bits, of known motions."""

    gyro_bias: Three
    """x, y, z: what the gyroscope said at rest."""
    gyro_plus: Three
    """What it said while turning by `speed_plus`."""
    gyro_minus: Three
    speed_plus: int
    """In degrees a second."""
    speed_minus: int
    acceleration_plus: Three
    """What the accelerometer said of one standard gravity along each axis."""
    acceleration_minus: Three

    def __post_init__(self) -> None:
        for name in ("gyro_bias", "gyro_plus", "gyro_minus", "acceleration_plus", "acceleration_minus"):
            check_integers(name, getattr(self, name), 3, -(2**15), 2**15 - 1)
        for name in ("speed_plus", "speed_minus"):
            check_integer(name, getattr(self, name), -(2**15), 2**15 - 1)

    @classmethod
    def parse(cls, report: bytes, transport: Transport = Transport.USB) -> Self:
        """Read feature report 0x05; RemoteProtocolError for another id, length or checksum."""
        v = _CALIBRATION.unpack_from(_checked(report, CALIBRATION_ID, transport), 1)
        return cls(
            gyro_bias=(v[0], v[1], v[2]),
            gyro_plus=(v[3], v[5], v[7]),
            gyro_minus=(v[4], v[6], v[8]),
            speed_plus=v[9],
            speed_minus=v[10],
            acceleration_plus=(v[11], v[13], v[15]),
            acceleration_minus=(v[12], v[14], v[16]),
        )

    def build(self, transport: Transport = Transport.USB) -> bytes:
        """Make feature report 0x05, 41 bytes."""
        report = bytearray(FEATURE_LENGTHS[CALIBRATION_ID])
        report[0] = CALIBRATION_ID
        pairs = [value for pair in zip(self.gyro_plus, self.gyro_minus, strict=True) for value in pair]
        ends = [value for pair in zip(self.acceleration_plus, self.acceleration_minus, strict=True) for value in pair]
        _CALIBRATION.pack_into(report, 1, *self.gyro_bias, *pairs, self.speed_plus, self.speed_minus, *ends)
        return _finished(report, transport)


def parse_address(report: bytes, transport: Transport = Transport.USB) -> str:
    """The controller's Bluetooth address, "aa:bb:cc:dd:ee:ff", from feature report 0x09.

    It is the same on USB and on Bluetooth. RemoteProtocolError for another id, length or checksum.
    """
    return _checked(report, ADDRESS_ID, transport)[6:0:-1].hex(":")


def build_address(address: str, transport: Transport = Transport.USB) -> bytes:
    """Make feature report 0x09, 20 bytes; ValueError for an address that is not "aa:bb:cc:dd:ee:ff"."""
    report = bytearray(FEATURE_LENGTHS[ADDRESS_ID])
    report[0] = ADDRESS_ID
    report[6:0:-1] = bytes.fromhex(checked_address(address).replace(":", ""))
    return _finished(report, transport)


@dataclass(frozen=True, slots=True)
class Firmware:
    """What runs in the controller."""

    hardware_version: int
    """32 bits."""
    firmware_version: int
    """32 bits."""
    update_version: int
    """16 bits; which features of the firmware to expect."""

    def __post_init__(self) -> None:
        for name, bits in (("hardware_version", 32), ("firmware_version", 32), ("update_version", 16)):
            check_integer(name, getattr(self, name), 0, 2**bits - 1)

    @classmethod
    def parse(cls, report: bytes, transport: Transport = Transport.USB) -> Self:
        """Read feature report 0x20; RemoteProtocolError for another id, length or checksum."""
        _checked(report, FIRMWARE_ID, transport)
        return cls(
            hardware_version=int.from_bytes(report[_HARDWARE : _HARDWARE + 4], "little"),
            firmware_version=int.from_bytes(report[_FIRMWARE : _FIRMWARE + 4], "little"),
            update_version=int.from_bytes(report[_UPDATE : _UPDATE + 2], "little"),
        )

    def build(self, transport: Transport = Transport.USB) -> bytes:
        """Make feature report 0x20, 64 bytes."""
        report = bytearray(FEATURE_LENGTHS[FIRMWARE_ID])
        report[0] = FIRMWARE_ID
        report[_HARDWARE : _HARDWARE + 4] = self.hardware_version.to_bytes(4, "little")
        report[_FIRMWARE : _FIRMWARE + 4] = self.firmware_version.to_bytes(4, "little")
        report[_UPDATE : _UPDATE + 2] = self.update_version.to_bytes(2, "little")
        return _finished(report, transport)
