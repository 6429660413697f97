"""The search for a controller, which keeps nobody waiting: opening one takes a few reports and their time."""

import threading
from collections.abc import Callable
from typing import Protocol

from common.errors import DeviceError
from operator_side.controller.port import OpenController

_CLOSE_TIMEOUT_S = 0.3


class Search(Protocol):
    """One look at a time."""

    def begin(self, preferred: str | None) -> None:
        """Start to look, for the controller of this address first, unless a look goes on."""

    def take(self) -> OpenController | DeviceError | None:
        """The controller, or why there is none; None while a look goes on."""

    def close(self) -> None:
        """Give up; what is found from now on is let go."""


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
