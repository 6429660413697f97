"""A simulated controller offered to Linux through /dev/uhid: its side of the protocol, without I/O."""

from dataclasses import dataclass
from typing import Protocol

from common.errors import DeviceError
from operator_side.dualsense.reports.models import SONY_VENDOR_ID, Model
from operator_side.dualsense.reports.report_descriptors import BLUETOOTH_DESCRIPTOR, USB_DESCRIPTOR
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.uhid.protocol import (
    BUS_BLUETOOTH,
    BUS_USB,
    FEATURE_REPORT,
    OUTPUT_REPORT,
    GetReport,
    Output,
    SetReport,
    Started,
    Stopped,
    UhidIdentity,
    create,
    destroy,
    get_report_reply,
    input_report,
    parse_event,
    set_report_reply,
)


class OfferedController(Protocol):
    """What is used of a simulated controller."""

    def read(self, now_s: float) -> bytes | None:
        """The newest input report, or None when there is no new one."""
        ...

    def take_report(self, report: bytes, now_s: float) -> None:
        """Take an output report; ValueError, and nothing changed, for one that it cannot read."""
        ...

    def get_feature(self, report_id: int) -> bytes:
        """The answer to a feature report, its id in front; DeviceError for one that it does not have."""
        ...


def identity(transport: Transport = Transport.USB, model: Model = Model.DUALSENSE, unique_id: str = "") -> UhidIdentity:
    """The identity of a controller on USB or on Bluetooth, for the kernel."""
    bluetooth = transport is Transport.BLUETOOTH
    maker = "" if bluetooth else "Sony Interactive Entertainment "
    return UhidIdentity(
        name=f"{maker}{model.title} Wireless Controller",
        vendor_id=SONY_VENDOR_ID,
        product_id=model.value,
        bus=BUS_BLUETOOTH if bluetooth else BUS_USB,
        descriptor=BLUETOOTH_DESCRIPTOR if bluetooth else USB_DESCRIPTOR,
        unique_id=unique_id,
        physical_place="feelahead/virtual-dualsense",
    )


@dataclass(slots=True)
class UhidCounts:
    """What has passed between the kernel and the controller."""

    inputs: int = 0
    outputs: int = 0
    refused: int = 0
    """Reports that the controller did not take, and questions that it could not answer."""
    features: int = 0


class UhidController:
    """One controller on one file of /dev/uhid: each method gives what is to be written to it."""

    def __init__(self, controller: OfferedController, told: UhidIdentity) -> None:
        self.counts = UhidCounts()
        self.driven = False
        """A driver has taken the device."""
        self._controller = controller
        self._identity = told

    def plug_in(self) -> bytes:
        """Let it appear. The kernel asks it for its features next, so `handle` must be called soon."""
        return create(self._identity)

    def unplug(self) -> bytes:
        """Let it disappear; `plug_in` may follow."""
        self.driven = False
        return destroy()

    def handle(self, event: bytes, now_s: float) -> bytes | None:
        """Take what the kernel said; the answer, if it wants one."""
        match parse_event(event):
            case Started():
                self.driven = True
            case Stopped():
                self.driven = False
            case Output(report, kind):
                self._write(report, kind, now_s)
            case GetReport(request, report_id, kind):
                return get_report_reply(request, self._answer(report_id, kind))
            case SetReport(request, kind, report):
                return set_report_reply(request, accepted=self._write(report, kind, now_s))
            case None:
                pass  # somebody opened or closed it, or a newer kernel said something
        return None

    def next_input(self, now_s: float) -> bytes | None:
        """The controller's newest input report for the kernel; None when there is no new one or nobody takes it."""
        report = self._controller.read(now_s)
        if report is None or not self.driven:
            return None
        self.counts.inputs += 1
        return input_report(report)

    def _write(self, report: bytes, kind: int, now_s: float) -> bool:
        try:
            if kind != OUTPUT_REPORT:
                raise ValueError(f"kind = {kind}; valid: {OUTPUT_REPORT}")
            self._controller.take_report(report, now_s)
        except ValueError:
            self.counts.refused += 1
            return False
        self.counts.outputs += 1
        return True

    def _answer(self, report_id: int, kind: int) -> bytes | None:
        try:
            if kind != FEATURE_REPORT:
                raise ValueError(f"kind = {kind}; valid: {FEATURE_REPORT}")
            answer = self._controller.get_feature(report_id)
        except (ValueError, DeviceError):
            self.counts.refused += 1
            return None
        self.counts.features += 1
        return answer
