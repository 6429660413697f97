"""Wrapper of a controller that writes in its own thread, so that the operator side's loop does not wait.

On USB a write lasts until the controller fetches it: some milliseconds (its interrupt endpoint's interval), longer on
a bad cable. Waiting writes are merged: of each part, the newest value is written.
"""

import threading
from typing import Final

from common.errors import DeviceError
from operator_side.controller.feel import Feel
from operator_side.controller.port import Controller
from operator_side.controller.state import ControllerState

CLOSE_TIMEOUT_S: Final = 0.3
"""Seconds to wait for the last write at the end; if it hangs for longer, the watchdog releases the triggers."""
STALL_S: Final = 0.05
"""Seconds after which a write counts as hanging; a normal write takes some milliseconds."""


class BackgroundWrites:
    """Controller that reads from another controller directly, and writes to it in a thread."""

    def __init__(self, device: Controller) -> None:
        """device: controller to wrap. Its `read` and `write` must tolerate concurrent calls."""
        self._device = device
        self._changed = threading.Condition()
        self._waiting: Feel | None = None
        self._now_s = 0.0
        self._written_since_s: float | None = None
        self._failure: Exception | None = None
        self._ends = False
        self._stuck = False
        # A daemon: a write that never returns must not keep the process from ending.
        self._thread = threading.Thread(target=self._write_on, daemon=True, name="controller writes")
        self._thread.start()

    @property
    def released(self) -> bool:
        """Whether the wrapped controller is released; False while a write waits or has not returned."""
        with self._changed:
            under_way = self._stuck or self._waiting is not None or self._written_since_s is not None
        return not under_way and self._device.released

    def stalls(self, now_s: float) -> bool:
        """Whether the write in progress was requested more than STALL_S ago."""
        with self._changed:
            return self._written_since_s is not None and now_s - self._written_since_s > STALL_S

    def read(self, now_s: float) -> ControllerState | None:
        """Read the wrapped controller; DeviceError also if an earlier write has failed."""
        self._raise_failure()
        return self._device.read(now_s)

    def write(self, feel: Feel, now_s: float) -> None:
        """Queue `feel` for the thread; DeviceError if an earlier write has failed."""
        self._raise_failure()
        with self._changed:
            self._waiting = feel if self._waiting is None else feel.completed_from(self._waiting)
            self._now_s = now_s
            self._changed.notify()

    def close(self) -> None:
        """Drop the waiting write and close the wrapped controller, which releases the triggers.

        If a write hangs, the wrapped controller is left open.
        """
        with self._changed:
            self._ends, self._waiting = True, None
            self._changed.notify()
        self._thread.join(CLOSE_TIMEOUT_S)
        self._stuck = self._thread.is_alive()
        if not self._stuck:
            self._device.close()

    def _write_on(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ends or self._waiting is not None)
                feel, self._waiting, now_s = self._waiting, None, self._now_s
                if feel is None:
                    return
                self._written_since_s = now_s
            try:
                self._device.write(feel, now_s)
            except Exception as error:  # raised again by the next `read` or `write`
                self._failure = error
                return
            finally:
                with self._changed:
                    self._written_since_s = None

    def _raise_failure(self) -> None:
        if self._failure is None:
            return
        if isinstance(self._failure, DeviceError):
            raise DeviceError(str(self._failure)) from self._failure
        raise self._failure
