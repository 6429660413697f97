"""Stand-in for hidapi that fails as the real library was measured to fail.

A read without a waiting report returns []. After the controller is unplugged, a read raises OSError, and a write
returns -1.
"""

import zlib
from dataclasses import dataclass, field
from typing import Any

from operator_side.controller.state import ControllerState
from operator_side.dualsense.hid.device import HidHandle
from operator_side.dualsense.reports.feature_report import ADDRESS_ID, FIRMWARE_ID, Firmware, build_address
from operator_side.dualsense.reports.input_report import build_input_report
from operator_side.dualsense.reports.transport import Transport

ADDRESS = "a4:5e:60:01:02:03"
FIRMWARE = Firmware(hardware_version=0x0616, firmware_version=0x0110002A, update_version=0x0630)
SIMPLE_REPORT = bytes.fromhex("01 80808080 080000 0000")
"""Short report that a controller sends over Bluetooth until a feature report has been read; nothing is touched."""
USB, BLUETOOTH = Transport.USB, Transport.BLUETOOTH


@dataclass
class FakeHandle:
    """Simulated controller, which is also hidapi's open handle for it."""

    transport: Transport = USB
    address: str = ADDRESS
    opens: bool = True
    reason: str = ""
    answers: bool = True
    """Whether the controller answers feature reports."""
    garbled: int = 0
    """Number of the next feature reports that arrive with a wrong bit."""
    silent: bool = False
    plugged_in: bool = True
    waiting: list[bytes] = field(default_factory=list)
    written: list[bytes] = field(default_factory=list)
    opened: bytes | None = None
    nonblocking: int = 0
    times_opened: int = 0
    closed: int = 0
    full_mode: bool = False
    repeats: bool = False
    """Whether it repeats one report, as a dongle whose controller is off."""
    sent: int = 0

    def report(self, sequence: int = 0) -> bytes:
        return build_input_report(ControllerState(), self.transport, sequence)

    def next_report(self) -> bytes:
        """Return a report with the next number; the same one if it repeats."""
        self.sent += 1
        return self.report(0 if self.repeats else (self.sent - 1) % 256)

    def open_path(self, path: bytes) -> None:
        if not self.opens:
            raise OSError("open failed")
        self.opened = path
        self.times_opened += 1

    def set_nonblocking(self, flag: int) -> int:
        self.nonblocking = flag
        return 0

    def read(self, max_length: int, timeout_ms: int = 0) -> list[int]:
        assert timeout_ms > 0 or self.nonblocking == 1, "the loop would wait"
        if not self.plugged_in:
            raise OSError("read error")
        if timeout_ms > 0 and not self.waiting and not self.silent:
            return list(self._first_report())
        return list(self.waiting.pop(0)[:max_length]) if self.waiting else []

    def write(self, data: bytes) -> int:
        if not self.plugged_in:
            return -1
        self.written.append(data)
        return len(data)

    def get_feature_report(self, report_num: int, max_length: int) -> list[int]:
        if not (self.answers and self.plugged_in):
            raise OSError("read error")
        report = bytearray(
            {
                ADDRESS_ID: build_address(self.address, self.transport),
                FIRMWARE_ID: FIRMWARE.build(self.transport),
            }[report_num]
        )
        self.full_mode = self.full_mode or report_num in (ADDRESS_ID, FIRMWARE_ID)
        if self.garbled > 0:
            self.garbled -= 1
            report[3] ^= 0x10
        return list(report[:max_length])

    def close(self) -> None:
        self.closed += 1

    def error(self) -> str:
        return self.reason

    def _first_report(self) -> bytes:
        if self.transport is BLUETOOTH and not self.full_mode:
            return SIMPLE_REPORT
        return self.next_report()


class FakeBackend:
    """All controllers of the system, by product id and then path. A path always opens the same controller."""

    def __init__(self, found: dict[int, dict[bytes, FakeHandle]]) -> None:
        self.found = found

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        assert vendor_id == 0x054C
        return [{"path": path} for path in self.found.get(product_id, {})]

    def device(self) -> HidHandle:
        return _Unopened(self)


class _Unopened(FakeHandle):
    """Handle that is not yet open: `open_path` turns it into the `FakeHandle` of the controller at that path."""

    def __init__(self, backend: FakeBackend) -> None:
        super().__init__()
        self._backend = backend

    def open_path(self, path: bytes) -> None:
        for controllers in self._backend.found.values():
            if path in controllers:
                controller = controllers[path]
                self.reason = controller.reason
                controller.open_path(path)
                self.__class__ = FakeHandle  # type: ignore[assignment]
                self.__dict__ = controller.__dict__
                return
        self.reason = "No such file or directory"
        raise OSError("open failed")


def valid_checksum(report: bytes) -> bool:
    """Return whether the CRC-32 of an output report over Bluetooth is right, without use of the tested code."""
    return zlib.crc32(b"\xa2" + report[:-4]) == int.from_bytes(report[-4:], "little")
