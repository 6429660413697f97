"""The protocol of /dev/uhid, by which a program offers an HID device to Linux: bytes only, no I/O.

Each read and each write is one `struct uhid_event` of linux/uhid.h: a type and, packed, what belongs to it. The
kernel fills short writes up with zeros, and a reader does the same with short reads. Integers are in the machine's
byte order.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Final

from msgspec import Meta

from common.limits import check_limits

EVENT_LENGTH: Final = 4380
"""sizeof(struct uhid_event), padded to 8 bytes; the length to ask for with each read."""
REPORT_MAX_LENGTH: Final = 4096
BUS_USB: Final = 0x03
BUS_BLUETOOTH: Final = 0x05
FEATURE_REPORT: Final = 0
OUTPUT_REPORT: Final = 1
INPUT_OUTPUT_ERROR: Final = 5
"""EIO, which hidraw and drivers report for an answer with an error."""


class _Type(IntEnum):
    """enum uhid_event_type, without what is obsolete or not heeded."""

    DESTROY = 1
    START = 2
    STOP = 3
    OUTPUT = 6
    GET_REPORT = 9
    GET_REPORT_REPLY = 10
    CREATE2 = 11
    INPUT2 = 12
    SET_REPORT = 13
    SET_REPORT_REPLY = 14


HalfWord = Annotated[int, Meta(ge=0, le=0xFFFF)]

_VERSION, _COUNTRY = 0x0100, 0
_TYPE = struct.Struct("=I")
# Name, physical place, unique id; the descriptor's size, bus; vendor, product, version, country.
_CREATE = struct.Struct("=I128s64s64sHHIIII")
_INPUT = struct.Struct("=IH")
_OUTPUT_TAIL = struct.Struct("=HB")  # size and kind, after the full length of the data
_GET = struct.Struct("=IBB")
_GET_REPLY = struct.Struct("=IIHH")
_SET = struct.Struct("=IBBH")
_SET_REPLY = struct.Struct("=IIH")


@dataclass(frozen=True, slots=True)
class UhidIdentity:
    """Identity of a device, for the kernel."""

    name: Annotated[str, Meta(max_length=127)]
    vendor_id: HalfWord
    product_id: HalfWord
    bus: HalfWord
    """BUS_USB or BUS_BLUETOOTH."""
    descriptor: bytes
    """The report descriptor, 1 to 4096 bytes."""
    unique_id: Annotated[str, Meta(max_length=63)] = ""
    """As a Bluetooth address; drivers may refuse a second device that has the same."""
    physical_place: Annotated[str, Meta(max_length=63)] = ""

    def __post_init__(self) -> None:
        check_limits(self)


@dataclass(frozen=True, slots=True)
class Started:
    """A driver has taken the device."""


@dataclass(frozen=True, slots=True)
class Stopped:
    """The driver has let the device go."""


@dataclass(frozen=True, slots=True)
class Output:
    """A report for the device."""

    report: bytes
    """With its id in front."""
    kind: int = OUTPUT_REPORT


@dataclass(frozen=True, slots=True)
class GetReport:
    """A question that waits up to 5 s for `get_report_reply` with the same number."""

    request: int
    report_id: int
    kind: int


@dataclass(frozen=True, slots=True)
class SetReport:
    """A report for the device that waits up to 5 s for `set_report_reply` with the same number."""

    request: int
    kind: int
    report: bytes
    """With its id in front."""


UhidEvent = Started | Stopped | Output | GetReport | SetReport


def parse_event(event: bytes) -> UhidEvent | None:
    """Read what the kernel says; None for a type that is not heeded here. ValueError for an impossible length."""
    if not _TYPE.size <= len(event) <= EVENT_LENGTH:
        raise ValueError(f"event has {len(event)} bytes; valid: {_TYPE.size} to {EVENT_LENGTH}")
    (kind,) = _TYPE.unpack_from(event)
    payload = event[_TYPE.size :].ljust(EVENT_LENGTH - _TYPE.size, b"\0")
    parsed: UhidEvent | None = None
    match kind:
        case _Type.START:
            parsed = Started()
        case _Type.STOP:
            parsed = Stopped()
        case _Type.OUTPUT:
            size, report_kind = _OUTPUT_TAIL.unpack_from(payload, REPORT_MAX_LENGTH)
            parsed = Output(_sized(payload, 0, size), report_kind)
        case _Type.GET_REPORT:
            parsed = GetReport(*_GET.unpack_from(payload))
        case _Type.SET_REPORT:
            request, _, report_kind, size = _SET.unpack_from(payload)
            parsed = SetReport(request, report_kind, _sized(payload, _SET.size, size))
    return parsed


def _sized(payload: bytes, start: int, size: int) -> bytes:
    if size > REPORT_MAX_LENGTH:
        raise ValueError(f"an event's report has {size} bytes; valid: up to {REPORT_MAX_LENGTH}")
    return payload[start : start + size]


def create(identity: UhidIdentity) -> bytes:
    """UHID_CREATE2: let a device appear."""
    head = _CREATE.pack(
        _Type.CREATE2,
        identity.name.encode(),
        identity.physical_place.encode(),
        identity.unique_id.encode(),
        len(identity.descriptor),
        identity.bus,
        identity.vendor_id,
        identity.product_id,
        _VERSION,
        _COUNTRY,
    )
    return head + identity.descriptor


def destroy() -> bytes:
    """UHID_DESTROY: let it disappear; the file may create another one afterwards."""
    return _TYPE.pack(_Type.DESTROY)


def input_report(report: bytes) -> bytes:
    """UHID_INPUT2: the device sends a report, its id in front. ValueError when it is too long."""
    return _INPUT.pack(_Type.INPUT2, _checked_length(report)) + report


def get_report_reply(request: int, report: bytes | None) -> bytes:
    """UHID_GET_REPORT_REPLY: the answer, its id in front; None refuses the question. ValueError when it is too long."""
    error, answer = (INPUT_OUTPUT_ERROR, b"") if report is None else (0, report)
    return _GET_REPLY.pack(_Type.GET_REPORT_REPLY, request, error, _checked_length(answer)) + answer


def set_report_reply(request: int, *, accepted: bool) -> bytes:
    """UHID_SET_REPORT_REPLY: whether the device took the report."""
    return _SET_REPLY.pack(_Type.SET_REPORT_REPLY, request, 0 if accepted else INPUT_OUTPUT_ERROR)


def _checked_length(report: bytes) -> int:
    if len(report) > REPORT_MAX_LENGTH:
        raise ValueError(f"report has {len(report)} bytes; valid: up to {REPORT_MAX_LENGTH}")
    return len(report)
