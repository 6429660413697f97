"""Access to /dev/uhid, and the loop that runs a simulated controller on it."""

import contextlib
import errno
import os
import select
from collections.abc import Callable
from pathlib import Path
from typing import Final

from common.clock import Clock
from common.errors import ConfigurationError, DeviceError
from common.realtime.pacing import Pacer, wait_for_turn
from operator_side.dualsense.uhid.controller import EVENT_LENGTH, UhidController

UHID_PATH: Final = Path("/dev/uhid")

_IN_A_CONTAINER = "in a container, on its host, and start it with --device=/dev/uhid"


class UhidFile:
    """Open /dev/uhid. The kernel removes the device when the file closes, however the process ends."""

    def __init__(self, path: Path = UHID_PATH) -> None:
        """Open `path`; ConfigurationError, with the remedy in one line, if that fails."""
        self._descriptor: int | None = None
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NONBLOCK)
        except FileNotFoundError:
            raise ConfigurationError(
                f"no {path}, by which Linux takes virtual controllers: sudo modprobe uhid ({_IN_A_CONTAINER})"
            ) from None
        except PermissionError:
            raise ConfigurationError(
                f"no permission to open {path}: sudo setfacl -m u:$USER:rw {path}, or as root ({_IN_A_CONTAINER})"
            ) from None
        except OSError as error:
            raise ConfigurationError(
                f"{path} cannot be opened ({os.strerror(error.errno or 0)}); try sudo modprobe uhid ({_IN_A_CONTAINER})"
            ) from None

    def __enter__(self) -> "UhidFile":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def wait(self, timeout_s: float) -> bool:
        """Wait at most `timeout_s` for an event of the kernel; return whether there is one."""
        return bool(select.select([self._open_descriptor()], [], [], max(0.0, timeout_s))[0])

    def read(self) -> bytes | None:
        """Return one event of the kernel, without waiting; None if there is none."""
        try:
            return os.read(self._open_descriptor(), EVENT_LENGTH) or None
        except BlockingIOError:
            return None

    def write(self, event: bytes) -> None:
        """Write an event; DeviceError if the kernel refuses it, as when it has removed the device."""
        try:
            os.write(self._open_descriptor(), event)
        except OSError as error:
            reason = os.strerror(error.errno or 0)
            said = "the kernel has released the controller" if error.errno == errno.EINVAL else "the kernel refused"
            raise DeviceError(f"{said} ({reason}); its messages: sudo dmesg | grep playstation") from error

    def close(self) -> None:
        """Close the file; safe to call again."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def _open_descriptor(self) -> int:
        if self._descriptor is None:
            raise DeviceError("/dev/uhid is closed; open it again")
        return self._descriptor


def offer(
    file: UhidFile,
    controller: UhidController,
    clock: Clock,
    period_s: float,
    going: Callable[[float], bool],
) -> None:
    """Plug `controller` in, and run it while `going(now_s)`, called every `period_s`, is True; then unplug it.

    Requests of the kernel are answered at once. Each period the newest input report is sent, if there is a new one.
    """
    file.write(controller.plug_in())
    pacer = Pacer(period_s, clock.now())
    try:
        while True:
            now_s = clock.now()
            while (event := file.read()) is not None:
                if (answer := controller.handle(event, now_s)) is not None:
                    file.write(answer)
            if pacer.due(now_s):
                pacer.begin(now_s)
                if not going(now_s):
                    break
                if (report := controller.next_input(now_s)) is not None:
                    file.write(report)
            wait_for_turn(pacer, clock, file.wait, spin_s=0.0)
    finally:
        with contextlib.suppress(DeviceError):  # the kernel may have removed the device before
            file.write(controller.unplug())
