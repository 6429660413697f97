"""A DualSense that plays recorded input reports to whichever hidapi binding asks, and keeps what is written to it."""

import types
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from operator_side.dualsense.reports.feature_report import ADDRESS_ID, CALIBRATION_ID, FIRMWARE_ID

_VENDOR_ID: Final = 0x054C
_PRODUCT_ID: Final = 0x0CE6


class Player:
    """The controller: input reports in order, over and over when `endless`, else unplugged after the last one."""

    def __init__(self, reports: Sequence[bytes], features: dict[int, bytes] | None = None, *, endless: bool = False):
        self.written: list[bytes] = []
        """Every output report, in order."""
        self._reports = reports
        self._features = features or {}
        self._endless = endless
        self._next = 0

    def read(self) -> bytes:
        """The next input report; OSError when unplugged."""
        if self._gone:
            raise OSError("read error")
        report = self._reports[self._next % len(self._reports)]
        self._next += 1
        return report

    def write(self, report: bytes) -> int:
        """Take an output report; as hidapi does, −1 when unplugged."""
        if self._gone:
            return -1
        self.written.append(bytes(report))
        return len(report)

    @property
    def _gone(self) -> bool:
        return self._next >= len(self._reports) and not self._endless

    def feature(self, report_id: int) -> bytes:
        """A feature report; OSError where there is none."""
        if report_id not in (ADDRESS_ID, CALIBRATION_ID, FIRMWARE_ID) or report_id not in self._features:
            raise OSError("ioctl (GFEATURE): not supported")
        return self._features[report_id]


class CythonHandle:
    """The player behind the binding `hidapi` from PyPI (its modules hid and hidraw)."""

    def __init__(self, player: Player) -> None:
        self._player = player

    def open_path(self, path: bytes) -> None:
        """There is one, wherever."""
        del path

    def set_nonblocking(self, flag: int) -> int:
        """It never waits anyway."""
        del flag
        return 0

    def read(self, max_length: int, timeout_ms: int = 0) -> list[int]:
        """The next report."""
        del max_length, timeout_ms
        return list(self._player.read())

    def write(self, data: bytes) -> int:
        """How many bytes were taken."""
        return self._player.write(data)

    def get_feature_report(self, report_num: int, max_length: int) -> list[int]:
        """A feature report."""
        del max_length
        return list(self._player.feature(report_num))

    def close(self) -> None:
        """Nothing is held."""

    def error(self) -> str:
        """What failures there are."""
        return "unplugged"


class CythonBackend:
    """The module itself, with one controller to be found."""

    def __init__(self, player: Player) -> None:
        self._player = player

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        """The controller, where its ids are asked for."""
        if (vendor_id, product_id) != (_VENDOR_ID, _PRODUCT_ID):
            return []
        return [{"path": b"/dev/hidraw-player", "product_id": product_id, "vendor_id": vendor_id}]

    def device(self) -> CythonHandle:
        """A handle that is not open yet."""
        return CythonHandle(self._player)


@dataclass(frozen=True)
class _Found:
    """What pydualsense's binding finds."""

    vendor_id: int = _VENDOR_ID
    product_id: int = _PRODUCT_ID


def ctypes_binding(player: Player) -> types.ModuleType:
    """The player as the module `hidapi` of PyPI's hidapi-usb, which is pydualsense's binding."""

    class Device:
        def __init__(self, vendor_id: int, product_id: int) -> None:
            del vendor_id, product_id

        def read(self, length: int) -> bytes:
            return player.read()[:length]

        def write(self, report: bytes) -> int:
            return player.write(bytes(report))

        def close(self) -> None:
            pass

    module = types.ModuleType("hidapi")
    vars(module).update(Device=Device, enumerate=lambda vendor_id=0: [_Found()] if vendor_id == _VENDOR_ID else [])
    return module
