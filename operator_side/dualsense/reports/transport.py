"""USB and Bluetooth reports: ids, lengths, offset of the common block, and checksum.

Both transports carry the same block of fields, the common block. On Bluetooth it begins later in the report, and a
checksum ends the report. Layout: Linux hid-playstation, SDL and the controllers wiki, which agree. The transport is
told from the reports' ids and lengths, as bus type and interface number are wrong for a virtual controller (measured
over uhid).
"""

import zlib
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final

from common.errors import RemoteProtocolError


class Transport(Enum):
    """Connection over which the reports come."""

    USB = "USB"
    BLUETOOTH = "Bluetooth"


@dataclass(frozen=True, slots=True)
class Framing:
    """Report's id, length in bytes with the id, and offset of the common block."""

    report_id: int
    length: int
    start: int


INPUT_FRAMING: Final = {Transport.USB: Framing(0x01, 64, 1), Transport.BLUETOOTH: Framing(0x31, 78, 2)}
OUTPUT_FRAMING: Final = {Transport.USB: Framing(0x02, 48, 1), Transport.BLUETOOTH: Framing(0x31, 78, 3)}

_SIMPLE_KINDS: Final = ((0x01, 10), (0x01, 78))
"""Ids and lengths of the simple reports that Bluetooth sends until a feature is read or an effect written.

Some systems pad each report to the length of the longest, 78 bytes (SDL)."""
_INPUT_KINDS: Final = {
    (0x01, 64): Transport.USB,
    (0x31, 78): Transport.BLUETOOTH,
    **dict.fromkeys(_SIMPLE_KINDS, Transport.BLUETOOTH),
}


def transport_of_input(report: bytes) -> Transport:
    """Return the transport for which an input report's id and length are valid; RemoteProtocolError if none."""
    transport = _INPUT_KINDS.get((report[0], len(report))) if report else None
    if transport is None:
        raise RemoteProtocolError(
            f"input report: {described(report)}; valid: id 0x01, 64 bytes (USB), id 0x31, 78 bytes (Bluetooth),"
            " id 0x01, 10 bytes (Bluetooth, simple)"
        )
    return transport


def is_simple_report(report: bytes) -> bool:
    """Return whether `report` is one of the simple reports with which Bluetooth starts, which nothing here decodes."""
    return report[:1] == b"\x01" and (0x01, len(report)) in _SIMPLE_KINDS


def described(report: bytes) -> str:
    """Return the report's id and length as text, for an error message."""
    return f"id 0x{report[0]:02x}, {len(report)} bytes" if report else "no bytes"


# Every Bluetooth report ends in a CRC-32 (zlib's) over one byte that is not sent, and the report (hid-playstation).

CHECKSUM_LENGTH: Final = 4


class Seed(IntEnum):
    """Byte with which the checksum begins, though it is not sent: Bluetooth HID header of each kind of report."""

    INPUT = 0xA1
    OUTPUT = 0xA2
    FEATURE = 0xA3
    """For a feature report that was read"""


_STARTS: Final = {seed: zlib.crc32(bytes([seed])) for seed in Seed}
"""CRC-32 of each Seed byte alone, from which a report's CRC-32 is continued"""
_RESIDUE: Final = 0x2144DF1C
"""CRC-32 of any content followed by its own CRC-32; it is the same for every content"""


def checksum(seed: Seed, content: bytes) -> int:
    """Return the checksum of a report whose bytes before the checksum are `content`."""
    return zlib.crc32(content, _STARTS[seed])


def sealed(seed: Seed, content: bytes) -> bytes:
    """Append the checksum to `content`, little-endian."""
    return content + checksum(seed, content).to_bytes(CHECKSUM_LENGTH, "little")


def check(seed: Seed, report: bytes) -> None:
    """Raise RemoteProtocolError unless the report ends in its valid checksum."""
    if zlib.crc32(report, _STARTS[seed]) != _RESIDUE or len(report) <= CHECKSUM_LENGTH:
        found = int.from_bytes(report[-CHECKSUM_LENGTH:], "little")
        valid = checksum(seed, report[:-CHECKSUM_LENGTH])
        raise RemoteProtocolError(f"{seed.name.lower()} report: checksum 0x{found:08x}; valid: 0x{valid:08x}")
