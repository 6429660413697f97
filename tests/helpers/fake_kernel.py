"""Stand-in for the kernel behind /dev/uhid, in virtual time, and the simplest possible simulated controller."""

import struct
from collections import deque
from dataclasses import dataclass, field

from common.clock import VirtualClock
from common.errors import DeviceError
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.uhid.controller import EVENT_LENGTH
from operator_side.dualsense.uhid.file import UhidFile

START, STOP, OUTPUT, GET_REPORT = 2, 3, 6, 9
FEATURE, OUT = 0, 1


def said(kind: int, payload: bytes = b"") -> bytes:
    """Return the bytes of an event from the kernel, padded to the length of the longest event."""
    return (struct.pack("=I", kind) + payload).ljust(EVENT_LENGTH, b"\0")


def output(report: bytes) -> bytes:
    return said(OUTPUT, report.ljust(4096, b"\0") + struct.pack("=HB", len(report), OUT))


def get_report(request: int, report_id: int, kind: int = FEATURE) -> bytes:
    return said(GET_REPORT, struct.pack("=IBB", request, report_id, kind))


@dataclass
class FakeKernel(UhidFile):
    """Stand-in for the file /dev/uhid: gives the events of `to_say`, keeps written ones. A wait advances the clock."""

    clock: VirtualClock
    to_say: deque[tuple[float, bytes]] = field(default_factory=deque)
    """Events that the kernel sends, as (time in seconds, event), earliest first"""
    heard: list[tuple[float, bytes]] = field(default_factory=list)
    refuses_from_s: float = float("inf")

    def wait(self, timeout_s: float) -> bool:
        until_s = self.clock.now() + timeout_s
        comes = bool(self.to_say) and self.to_say[0][0] <= until_s
        self.clock.advance_to(max(self.clock.now(), self.to_say[0][0]) if comes else until_s)
        return comes

    def read(self) -> bytes | None:
        if self.to_say and self.to_say[0][0] <= self.clock.now():
            return self.to_say.popleft()[1]
        return None

    def write(self, event: bytes) -> None:
        if self.clock.now() >= self.refuses_from_s:
            raise DeviceError("the kernel has released the controller")
        self.heard.append((self.clock.now(), event))

    def heard_of(self, kind: int) -> list[tuple[float, bytes]]:
        return [(now_s, event) for now_s, event in self.heard if event[0] == kind]


class PlainController(SimulatedDualSense):
    """Controller whose input report counts the reads. It accepts output report 2 and answers feature report 5."""

    def __init__(self) -> None:
        super().__init__()
        self.written: list[bytes] = []
        self.reads = 0

    def read_report(self, now_s: float) -> bytes | None:
        del now_s
        self.reads += 1
        return bytes([1, self.reads % 256])

    def apply_report(self, report: bytes, now_s: float) -> None:
        del now_s
        if report[0] != 2:
            raise ValueError(f"report {report[0]}")
        self.written.append(report)

    def get_feature(self, report_id: int) -> bytes:
        if report_id != 5:
            raise DeviceError(f"report_id = {report_id}")
        return b"\x05\x01\x02"
