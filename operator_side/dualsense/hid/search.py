"""The Device port, what feelahead asks of a controller, and the search for one, which keeps nobody waiting.

Input reports come as bytes, to be read by input_report.py; what to do goes as a value. Opening a controller takes a few
reports and their time, hence a thread.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from common.errors import DeviceError
from operator_side.dualsense.reports.output_report import OutputReport

_CLOSE_TIMEOUT_S = 0.3


class Device(Protocol):
    """A controller that is open. Any method may raise DeviceError; the text says what to do about it."""

    @property
    def released(self) -> bool:
        """Both triggers are free of any effect, as far as anybody can know."""

    def read(self, now_s: float) -> bytes | None:
        """The newest input report, older unread ones skipped, or None when there is no new one; never waits."""

    def write(self, output: OutputReport, now_s: float) -> None:
        """Have the controller do what `output` sets; ValueError, and nothing sent, for an effect never to be sent."""

    def close(self) -> None:
        """Take trigger effects, rumble and a warning light off if any were written, and let the controller go.

        Safe to call again; everything else raises DeviceError afterwards.
        """


def _never_stalls(now_s: float) -> bool:
    del now_s
    return False


@dataclass(frozen=True)
class OpenController:
    """A controller that a search has found and opened."""

    device: Device
    name: str
    """Model and transport, for people."""
    address: str | None = None
    """Address "aa:bb:cc:dd:ee:ff", the same on USB and Bluetooth; None when it did not answer."""
    path: bytes | None = None
    """Device node; None without hardware."""
    release: bytes = b""
    """Output report, ready for the wire, that takes every effect off; for the watchdog."""
    stalls: Callable[[float], bool] = _never_stalls
    """Whether a write does not return, at `now_s`: then nothing can be said to the controller by `device`."""


Find = Callable[[str | None], OpenController]
"""Find and open a controller, that of the given address first; DeviceError says why there is none."""


class BackgroundSearch:
    """Each look in a thread of its own, because a controller on Bluetooth may take its time to answer."""

    def __init__(self, find: Find) -> None:
        self._find = find
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._found: OpenController | DeviceError | None = None
        self._failure: Exception | None = None
        self._closed = False

    def begin(self, preferred: str | None) -> None:
        """Start to look, unless a look goes on."""
        if self._thread is not None or self._closed:
            return
        # A daemon: a controller that never answers must not keep the process from ending.
        self._thread = threading.Thread(target=self._look, args=(preferred,), daemon=True, name="controller search")
        self._thread.start()

    def take(self) -> OpenController | DeviceError | None:
        """The controller, or why there is none; any other failure in the thread is raised here."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread = None
        found, self._found = self._found, None
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure
        return found

    def close(self) -> None:
        """Give up; what is found from now on is let go."""
        with self._lock:
            self._closed = True
        if self._thread is not None:
            self._thread.join(_CLOSE_TIMEOUT_S)
        if isinstance(self._found, OpenController):
            self._found.device.close()
            self._found = None

    def _look(self, preferred: str | None) -> None:
        found: OpenController | DeviceError
        try:
            found = self._find(preferred)
        except DeviceError as error:
            found = error
        except Exception as error:  # raised again by `take`, in the thread that can end the process
            self._failure = error
            return
        with self._lock:
            if not self._closed:
                self._found = found
                return
        if isinstance(found, OpenController):
            found.device.close()


class Ready:
    """A search that finds what is there already: a simulated controller."""

    def __init__(self, controller: OpenController) -> None:
        self._controller: OpenController | None = controller

    def begin(self, preferred: str | None) -> None:
        """There is nothing to look for."""
        del preferred

    def take(self) -> OpenController | None:
        """The controller, once."""
        controller, self._controller = self._controller, None
        return controller

    def close(self) -> None:
        """There is nothing to give up."""


Search = BackgroundSearch | Ready
