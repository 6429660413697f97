"""A controller whose writes are made by a thread of their own, so that the loop waits for none of them.

On USB a write takes until the controller fetches it, some milliseconds (its interrupt endpoint's interval), and longer
on a bad cable. Only the newest of what waits goes out, part by part: latest wins here, too.
"""

import threading
from typing import Final

from common.errors import DeviceError
from operator_side.controller.feel import Feel
from operator_side.controller.port import Controller
from operator_side.controller.state import ControllerState

CLOSE_TIMEOUT_S: Final = 0.3
"""A write that has not returned by then is left to itself; the watchdog releases the triggers."""
STALL_S: Final = 0.05
"""A write takes some milliseconds: one that has not returned by then hangs for now."""


class BackgroundWrites:
    """The port around a device: reads go straight through, writes go by the thread."""

    def __init__(self, device: Controller) -> None:
        """`device` is written to by the thread alone; its `read` and `write` must bear being called at once."""
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
        """Whether the device is released; False while anything waits, and when a write has not returned."""
        with self._changed:
            under_way = self._stuck or self._waiting is not None or self._written_since_s is not None
        return not under_way and self._device.released

    def stalls(self, now_s: float) -> bool:
        """Whether what is being written was asked for more than STALL_S ago."""
        with self._changed:
            return self._written_since_s is not None and now_s - self._written_since_s > STALL_S

    def read(self, now_s: float) -> ControllerState | None:
        """Read the device; DeviceError also when a write has failed since."""
        self._raise_failure()
        return self._device.read(now_s)

    def write(self, feel: Feel, now_s: float) -> None:
        """Have it written soon; DeviceError when an earlier write has failed."""
        self._raise_failure()
        with self._changed:
            self._waiting = feel if self._waiting is None else feel.following(self._waiting)
            self._now_s = now_s
            self._changed.notify()

    def close(self) -> None:
        """Drop what waits, and close the device, which releases the triggers."""
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
            except Exception as error:  # raised again where it can be answered
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
