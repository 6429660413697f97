"""The checksum that ends every Bluetooth report: CRC-32 (zlib's) over a byte that is not sent, and the report.

The unsent byte is the Bluetooth HID header of the report's kind. Source: Linux hid-playstation.
"""

import zlib
from enum import IntEnum
from typing import Final

from common.errors import RemoteProtocolError

CHECKSUM_LENGTH: Final = 4


class Seed(IntEnum):
    """The header byte of each kind of report."""

    INPUT = 0xA1
    OUTPUT = 0xA2
    FEATURE = 0xA3
    """A feature that was read."""


_STARTS: Final = {seed: zlib.crc32(bytes([seed])) for seed in Seed}
"""The checksum of the header byte alone, from which the report's goes on."""
_RESIDUE: Final = 0x2144DF1C
"""The CRC-32 of anything that its own CRC-32 follows."""


def checksum(seed: Seed, content: bytes) -> int:
    """The CRC-32 of a report without its last four bytes."""
    return zlib.crc32(content, _STARTS[seed])


def sealed(seed: Seed, content: bytes) -> bytes:
    """`content` with its checksum after it, little-endian."""
    return content + checksum(seed, content).to_bytes(CHECKSUM_LENGTH, "little")


def check(seed: Seed, report: bytes) -> None:
    """RemoteProtocolError for a report that does not end in its checksum."""
    if zlib.crc32(report, _STARTS[seed]) != _RESIDUE or len(report) <= CHECKSUM_LENGTH:
        found = int.from_bytes(report[-CHECKSUM_LENGTH:], "little")
        valid = checksum(seed, report[:-CHECKSUM_LENGTH])
        raise RemoteProtocolError(f"{seed.name.lower()} report: checksum 0x{found:08x}; valid: 0x{valid:08x}")
