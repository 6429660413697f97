"""Feature reports, which a driver reads once: calibration (0x05), address (0x09) and firmware (0x20).

On Bluetooth their last four bytes are a checksum. Layout: Linux hid-playstation and the controllers wiki.
"""

import struct
from typing import Final, NamedTuple, Self

from common.errors import RemoteProtocolError
from operator_side.controller.port import checked_address
from operator_side.dualsense.reports.transport import CHECKSUM_LENGTH, Seed, Transport, check, described, sealed

CALIBRATION_ID: Final = 0x05
ADDRESS_ID: Final = 0x09
FIRMWARE_ID: Final = 0x20
FEATURE_LENGTHS: Final = {CALIBRATION_ID: 41, ADDRESS_ID: 20, FIRMWARE_ID: 64}
"""Length of each feature report in bytes, its id included"""

_VERSIONS: Final = struct.Struct("<II")
_HARDWARE, _UPDATE = 24, 44


def _checked(report: bytes, report_id: int, transport: Transport) -> bytes:
    length = FEATURE_LENGTHS[report_id]
    if len(report) != length or report[0] != report_id:
        raise RemoteProtocolError(f"feature report: {described(report)}; valid: id 0x{report_id:02x}, {length} bytes")
    if transport is Transport.BLUETOOTH:
        check(Seed.FEATURE, report)
    return report


def _finished(report_id: int, content: bytes, transport: Transport) -> bytes:
    """Make a feature report from id and content: padded with zeros, and with a checksum on Bluetooth."""
    report = (bytes((report_id,)) + content).ljust(FEATURE_LENGTHS[report_id], b"\0")
    return report if transport is Transport.USB else sealed(Seed.FEATURE, report[:-CHECKSUM_LENGTH])


def build_calibration(transport: Transport) -> bytes:
    """Make feature report 0x05, for motion sensors without errors; hid-playstation reads it when it starts.

    Gyroscope: bias 0, ±8640 counts at ±540 degrees a second. Accelerometer: 8192 counts for one gravity.
    """
    gyro, acceleration = (8640, -8640) * 3, (8192, -8192) * 3
    return _finished(CALIBRATION_ID, struct.pack("<17h", 0, 0, 0, *gyro, 540, 540, *acceleration), transport)


def parse_address(report: bytes, transport: Transport = Transport.USB) -> str:
    """Read the controller's Bluetooth address, "aa:bb:cc:dd:ee:ff", from feature report 0x09.

    The address is the same on USB and on Bluetooth. RemoteProtocolError for another id, length or checksum.
    """
    return _checked(report, ADDRESS_ID, transport)[6:0:-1].hex(":")


def build_address(address: str, transport: Transport = Transport.USB) -> bytes:
    """Make feature report 0x09, 20 bytes; ValueError unless the address has the form "aa:bb:cc:dd:ee:ff"."""
    return _finished(ADDRESS_ID, bytes.fromhex(checked_address(address).replace(":", ""))[::-1], transport)


class Firmware(NamedTuple):
    """Versions of a controller's hardware and firmware (32 bits each) and of its update (16 bits)."""

    hardware_version: int
    firmware_version: int
    update_version: int
    """Version by which drivers decide which features the firmware has"""

    @classmethod
    def parse(cls, report: bytes, transport: Transport = Transport.USB) -> Self:
        """Read feature report 0x20; RemoteProtocolError for another id, length or checksum."""
        _checked(report, FIRMWARE_ID, transport)
        hardware_version, firmware_version = _VERSIONS.unpack_from(report, _HARDWARE)
        return cls(hardware_version, firmware_version, int.from_bytes(report[_UPDATE : _UPDATE + 2], "little"))

    def build(self, transport: Transport = Transport.USB) -> bytes:
        """Make feature report 0x20, 64 bytes."""
        content = bytearray(_UPDATE + 1)
        _VERSIONS.pack_into(content, _HARDWARE - 1, self.hardware_version, self.firmware_version)
        content[_UPDATE - 1 :] = self.update_version.to_bytes(2, "little")
        return _finished(FIRMWARE_ID, bytes(content), transport)
