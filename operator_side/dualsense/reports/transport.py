"""How a controller is attached, and what that changes of its reports: ids, lengths, where the common block begins.

The same block of fields travels on USB and on Bluetooth, one byte further in on Bluetooth and with a checksum at
the end. Layout: Linux hid-playstation, SDL and the controllers wiki, which agree. The transport is told from the
reports themselves: a virtual controller's bus type and interface number say nothing (measured over uhid).
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.errors import RemoteProtocolError


class Transport(Enum):
    """What carries the reports."""

    USB = "USB"
    BLUETOOTH = "Bluetooth"


@dataclass(frozen=True, slots=True)
class Framing:
    """One kind of report: its id, its length in bytes with the id, and where the common block begins."""

    report_id: int
    length: int
    start: int


INPUT_FRAMING: Final = {Transport.USB: Framing(0x01, 64, 1), Transport.BLUETOOTH: Framing(0x31, 78, 2)}
OUTPUT_FRAMING: Final = {Transport.USB: Framing(0x02, 48, 1), Transport.BLUETOOTH: Framing(0x31, 78, 3)}

SIMPLE_REPORT_ID: Final = 0x01
SIMPLE_REPORT_LENGTH: Final = 10
"""Bluetooth starts with these short reports, under USB's id, until a feature is read or an effect written."""
PADDED_REPORT_LENGTH: Final = 78
"""Some systems pad every report to the longest one, the simple one too (SDL)."""

_INPUT_KINDS: Final = {
    (0x01, 64): Transport.USB,
    (0x31, 78): Transport.BLUETOOTH,
    (SIMPLE_REPORT_ID, SIMPLE_REPORT_LENGTH): Transport.BLUETOOTH,
    (SIMPLE_REPORT_ID, PADDED_REPORT_LENGTH): Transport.BLUETOOTH,
}


def transport_of_input(report: bytes) -> Transport:
    """Tell by an input report's id and length what carried it; RemoteProtocolError for any other id or length."""
    transport = _INPUT_KINDS.get((report[0], len(report))) if report else None
    if transport is None:
        raise RemoteProtocolError(
            f"input report: {described(report)}; valid: id 0x01, 64 bytes (USB), id 0x31, 78 bytes (Bluetooth),"
            " id 0x01, 10 bytes (Bluetooth, simple)"
        )
    return transport


def is_simple_report(report: bytes) -> bool:
    """A Bluetooth input report of the simple mode: sticks, triggers and buttons only."""
    return report[:1] == b"\x01" and len(report) in (SIMPLE_REPORT_LENGTH, PADDED_REPORT_LENGTH)


def described(report: bytes) -> str:
    """The id and the length of a report, for an error's text."""
    return f"id 0x{report[0]:02x}, {len(report)} bytes" if report else "no bytes"
