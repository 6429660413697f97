"""Search for a controller in the background: opening one takes a few reports' time."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait

from common.errors import DeviceError
from operator_side.controller.port import OpenController

_CLOSE_TIMEOUT_S = 0.3

Find = Callable[[str | None], OpenController]
"""Find and open a controller, preferably the one of the given address; DeviceError gives the reason for none."""


class BackgroundSearch:
    """One search at a time, in its own thread: a controller on Bluetooth may answer late."""

    def __init__(self, find: Find) -> None:
        self._find = find
        self._look: Future[OpenController] | None = None
        self._closed = False

    def begin(self, preferred: str | None) -> None:
        """Start a search unless one is running; prefer the controller of this address."""
        if self._look is None and not self._closed:
            self._look = Future()
            # A daemon: a controller that never answers must not keep the process from ending.
            about = self._find, preferred, self._look
            threading.Thread(target=_find_for, args=about, daemon=True, name="controller search").start()

    def take(self) -> OpenController | DeviceError | None:
        """Return the controller, or the reason for none; None during a search. Raises the thread's other errors."""
        if self._look is None or not self._look.done():
            return None
        look, self._look = self._look, None
        error = look.exception()
        return error if isinstance(error, DeviceError) else look.result()

    def close(self) -> None:
        """End the search; a controller found later is closed."""
        look, self._look, self._closed = self._look, None, True
        if look is not None:
            wait([look], _CLOSE_TIMEOUT_S)
            look.add_done_callback(_let_go)


def _find_for(find: Find, preferred: str | None, look: "Future[OpenController]") -> None:
    try:
        look.set_result(find(preferred))
    except Exception as error:  # raised again by `take`, in the thread that can end the process
        look.set_exception(error)


def _let_go(look: "Future[OpenController]") -> None:
    if look.exception() is None:
        look.result().device.close()


class Ready(BackgroundSearch):
    """Search that returns a given controller: a simulated one."""

    def __init__(self, controller: OpenController) -> None:
        super().__init__(lambda _: controller)
        self._look = Future()
        self._look.set_result(controller)

    def begin(self, preferred: str | None) -> None:
        """Do nothing: the controller is given."""
