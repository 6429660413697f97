"""Search for a controller in a thread, because opening a controller means waiting for its reports."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait

from common.errors import DeviceError
from operator_side.controller.port import OpenController

_CLOSE_TIMEOUT_S = 0.3

Find = Callable[[str | None], OpenController]
"""Function that opens a controller, preferably the one with the given address; DeviceError if it opens none."""


class BackgroundSearch:
    """Search in a thread, one at a time: a controller on Bluetooth may answer late."""

    def __init__(self, find: Find) -> None:
        self._find = find
        self._look: Future[OpenController] | None = None
        self._closed = False

    def begin(self, preferred: str | None) -> None:
        """Start a search unless one is running. preferred: address of the controller to prefer."""
        if self._look is None and not self._closed:
            self._look = Future()
            # A daemon thread: a controller that never answers must not keep the process from ending.
            about = self._find, preferred, self._look
            threading.Thread(target=_find_for, args=about, daemon=True, name="controller search").start()

    def take(self) -> OpenController | DeviceError | None:
        """Return the controller that was found, or the DeviceError why none was; None without a finished search.

        Any other error of the search is raised.
        """
        if self._look is None or not self._look.done():
            return None
        look, self._look = self._look, None
        error = look.exception()
        return error if isinstance(error, DeviceError) else look.result()

    def close(self) -> None:
        """End the search; a controller that it still finds is closed."""
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
    """Search that returns a given controller, such as a simulated one, once."""

    def __init__(self, controller: OpenController) -> None:
        super().__init__(lambda _: controller)
        self._look = Future()
        self._look.set_result(controller)

    def begin(self, preferred: str | None) -> None:
        """Do nothing, as the controller is given."""
