"""The uhid protocol by which a simulated controller is offered to Linux: bytes in, bytes out, without I/O.

Each read from and each write to /dev/uhid is one `struct uhid_event` of linux/uhid.h: a type, then packed content. The
kernel pads short writes with zeros; we pad short reads likewise. Integers are in the machine's byte order.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Final

from msgspec import Meta

from common.errors import DeviceError
from common.limits import Limited
from operator_side.dualsense.reports.models import SONY_VENDOR_ID, Model
from operator_side.dualsense.reports.report_descriptors import BLUETOOTH_DESCRIPTOR, USB_DESCRIPTOR
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SimulatedDualSense

EVENT_LENGTH: Final = 4380
"""sizeof(struct uhid_event), padded to 8 bytes; the length of each read"""
_REPORT_MAX_LENGTH: Final = 4096
BUS: Final = {Transport.USB: 0x03, Transport.BLUETOOTH: 0x05}
_FEATURE_REPORT, _OUTPUT_REPORT = 0, 1
_INPUT_OUTPUT_ERROR: Final = 5
"""Error code EIO in an answer, which hidraw and drivers pass on to programs"""
_VERSION, _COUNTRY = 0x0100, 0


class _Type(IntEnum):
    """Types of events that are used here, from enum uhid_event_type."""

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


_TYPE = struct.Struct("=I")
# Name, physical location, unique id; the descriptor's size, bus; vendor, product, version, country.
_CREATE = struct.Struct("=I128s64s64sHHIIII")
_INPUT = struct.Struct("=IH")
_OUTPUT_TAIL = struct.Struct("=HB")  # size and kind, after the full length of the data
_GET = struct.Struct("=IBB")
_GET_REPLY = struct.Struct("=IIHH")
_SET = struct.Struct("=IBBH")
_SET_REPLY = struct.Struct("=IIH")


@dataclass(frozen=True, slots=True)
class UhidIdentity(Limited):
    """Identity with which a simulated DualSense appears to the kernel."""

    transport: Transport = Transport.USB
    model: Model = Model.DUALSENSE
    unique_id: Annotated[str, Meta(max_length=63)] = ""
    """Bluetooth address; drivers may refuse a second device with the same address"""

    @property
    def name(self) -> str:
        """Name of the device that the kernel shows."""
        maker = "Sony Interactive Entertainment " if self.transport is Transport.USB else ""
        return f"{maker}{self.model.title} Wireless Controller"

    def create(self) -> bytes:
        """Make the event UHID_CREATE2, by which the device appears."""
        descriptor = USB_DESCRIPTOR if self.transport is Transport.USB else BLUETOOTH_DESCRIPTOR
        texts = (text.encode() for text in (self.name, "feelahead/virtual-dualsense", self.unique_id))
        numbers = (SONY_VENDOR_ID, self.model.value, _VERSION, _COUNTRY)
        return _CREATE.pack(_Type.CREATE2, *texts, len(descriptor), BUS[self.transport], *numbers) + descriptor


@dataclass(slots=True)
class UhidCounts:
    """Counts of messages between the kernel and the controller."""

    inputs: int = 0
    outputs: int = 0
    refused: int = 0
    """Number of reports and requests that the controller refused"""
    features: int = 0


class UhidController:
    """Simulated controller on an open /dev/uhid. Methods return the bytes that the caller must write to that file."""

    def __init__(self, controller: SimulatedDualSense, identity: UhidIdentity) -> None:
        self.counts = UhidCounts()
        self.driven = False
        """Whether a kernel driver uses the device"""
        self._controller = controller
        self._identity = identity

    def plug_in(self) -> bytes:
        """Return the event that makes the device appear. The kernel then requests features, so call `handle` soon."""
        return self._identity.create()

    def unplug(self) -> bytes:
        """Return the event UHID_DESTROY, by which the device disappears; `plug_in` may follow."""
        self.driven = False
        return _TYPE.pack(_Type.DESTROY)

    def handle(self, event: bytes, now_s: float) -> bytes | None:
        """Take an event of the kernel; return the answer, or None if the event needs none.

        The kernel waits up to 5 s for an answer, which has the request's number. Other events are ignored: a program
        opens or closes the device, or a newer kernel sends an unknown event. ValueError for an impossible length.
        """
        if not _TYPE.size <= len(event) <= EVENT_LENGTH:
            raise ValueError(f"the event has {len(event)} bytes; valid: {_TYPE.size} to {EVENT_LENGTH}")
        payload = event[_TYPE.size :].ljust(EVENT_LENGTH - _TYPE.size, b"\0")
        match _TYPE.unpack_from(event)[0]:
            case _Type.START:
                self.driven = True
            case _Type.STOP:
                self.driven = False
            case _Type.OUTPUT:
                size, kind = _OUTPUT_TAIL.unpack_from(payload, _REPORT_MAX_LENGTH)
                self._write(_sized(payload, size), kind, now_s)
            case _Type.GET_REPORT:
                request, report_id, kind = _GET.unpack_from(payload)
                answer = self._answer(report_id, kind)
                error = _INPUT_OUTPUT_ERROR if answer is None else 0
                head = _GET_REPLY.pack(_Type.GET_REPORT_REPLY, request, error, len(answer or b""))
                return head + (answer or b"")
            case _Type.SET_REPORT:
                request, _, kind, size = _SET.unpack_from(payload)
                taken = self._write(_sized(payload[_SET.size :], size), kind, now_s)
                return _SET_REPLY.pack(_Type.SET_REPORT_REPLY, request, 0 if taken else _INPUT_OUTPUT_ERROR)
        return None

    def next_input(self, now_s: float) -> bytes | None:
        """Return the event with the newest input report; None without a new report or without a driver."""
        report = self._controller.read_report(now_s)
        if report is None or not self.driven:
            return None
        self.counts.inputs += 1
        return _INPUT.pack(_Type.INPUT2, len(report)) + report

    def _write(self, report: bytes, kind: int, now_s: float) -> bool:
        try:
            if kind != _OUTPUT_REPORT:
                raise ValueError(f"kind = {kind}; valid: {_OUTPUT_REPORT}")
            self._controller.apply_report(report, now_s)
        except ValueError:
            self.counts.refused += 1
            return False
        self.counts.outputs += 1
        return True

    def _answer(self, report_id: int, kind: int) -> bytes | None:
        try:
            if kind != _FEATURE_REPORT:
                raise ValueError(f"kind = {kind}; valid: {_FEATURE_REPORT}")
            answer = self._controller.get_feature(report_id)
        except (ValueError, DeviceError):
            self.counts.refused += 1
            return None
        self.counts.features += 1
        return answer


def _sized(payload: bytes, size: int) -> bytes:
    if size > _REPORT_MAX_LENGTH:
        raise ValueError(f"an event's report has {size} bytes; valid: up to {_REPORT_MAX_LENGTH}")
    return payload[:size]
