"""feelahead-operator or `feelahead controller` on a controller made of two files, for tests of processes.

    python plugged_operator.py FOLDER [controller] [flags of feelahead-operator or feelahead controller]

FOLDER/hidraw3 is a FIFO that gets the writes to the controller. While FOLDER/plugged exists, the controller is plugged
in. While FOLDER/broken exists, reads and writes raise an error that no driver should raise.
"""

import os
import sys
from pathlib import Path
from typing import Any

from common.clock import MonotonicClock
from common.command.launch import launch
from feelahead.commands.controller.command import controller
from operator_side.dualsense.hid.device import HidHandle
from operator_side.main import command
from tests.helpers.fake_hid import FakeHandle

FOLDER = Path(sys.argv.pop(1))
CONTROLLER = FOLDER / "hidraw3"
REPORT_PERIOD_S = 0.004


class PluggedHandle(FakeHandle):
    """Controller that is plugged in while the file FOLDER/plugged exists."""

    def __init__(self) -> None:
        super().__init__()
        self._file = -1
        self._clock = MonotonicClock()
        self._reported_s = self._clock.now()

    def open_path(self, path: bytes) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK)

    def read(self, max_length: int, timeout_ms: int = 0) -> list[int]:
        self._look()
        now_s = self._clock.now()
        if timeout_ms == 0 and now_s - self._reported_s < REPORT_PERIOD_S:
            return []
        self._reported_s = now_s
        return list(self.next_report()[:max_length])

    def write(self, data: bytes) -> int:
        self._look()
        return os.write(self._file, data) if self.plugged_in else -1

    def close(self) -> None:
        os.close(self._file)

    def _look(self) -> None:
        self.plugged_in = (FOLDER / "plugged").exists()
        if (FOLDER / "broken").exists():
            raise RuntimeError("as no driver should")
        if not self.plugged_in:
            raise OSError("read error")


class PluggedBackend:
    """The system's controllers: one while FOLDER/plugged exists, otherwise none."""

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        del vendor_id
        there = product_id == 0x0CE6 and (FOLDER / "plugged").exists()
        return [{"path": os.fsencode(CONTROLLER)}] if there else []

    def device(self) -> HidHandle:
        return PluggedHandle()


if __name__ == "__main__":
    if sys.argv[1:2] == ["controller"]:
        launch("feelahead", lambda: lambda arguments: controller(arguments[1:], PluggedBackend()))
    launch("feelahead-operator", lambda: lambda arguments: command(arguments, PluggedBackend()))
