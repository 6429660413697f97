"""The controller as something that comes and goes: looks for one, loses it, finds it again.

Without I/O: the search that opens a controller is an argument, and so is `now_s`.
"""

from typing import Final, Protocol

from common.errors import DeviceError, NoDeviceError, NoDriverError
from common.status.codes import ConnectionState
from operator_side.controller.feel import Feel
from operator_side.controller.port import OpenController
from operator_side.controller.search import BackgroundSearch
from operator_side.controller.state import ControllerState

BEAT_PERIOD_S: Final = 0.05
"""From one sign of life for the watchdog to the next, while an effect is on."""
RETELL_AFTER_S: Final = 0.1
"""Half the watchdog's patience: when it has released the triggers, one of two gaps in a row was longer than this,
however long we were kept between looking at the clock and beating."""
LOOK_PERIOD_S: Final = 1.0
"""From one look to the next, and from a loss to the first look: by then the robot side has long stopped."""


class Listener(Protocol):
    """The part that has to know at once that the hands came or went."""

    def controller_found(self, now_s: float) -> None:
        """There is one, and nothing is known of what its triggers do."""

    def controller_lost(self, now_s: float) -> None:
        """There is none any more."""


class Guard(Protocol):
    """The part that releases a controller when we are killed, or hang."""

    def hold(self, path: bytes, release: bytes) -> None:
        """From now on, should we die, `release` is to be written to the controller at `path`."""

    def let_go(self) -> None:
        """There is nothing to release any more."""

    def beat(self) -> None:
        """An effect is on, and we live: should no further beat follow in time, we hang."""

    def rest(self) -> None:
        """No effect is on: there are no beats until the next one."""


class Connection:
    """One controller at a time. None of its methods waits, and none raises DeviceError but `update` (NoDriverError)."""

    def __init__(self, search: BackgroundSearch, listener: Listener, guard: Guard | None = None) -> None:
        self.state = ConnectionState.ABSENT
        self.found = 0
        """Number of times that a controller was found."""
        self.released = True
        """Whether the last controller that was let go had its triggers released; False for one that was unplugged."""
        self.controller: OpenController | None = None
        """The one that is connected."""
        self._search = search
        self._listener = listener
        self._guard = guard
        self._held = False
        self._beat_s: float | None = None
        self._address: str | None = None
        self._next_look_s: float | None = None
        self._refused: str | None = None
        self._said: set[str] = set()
        self._notes: list[str] = []
        self._closed = False

    def update(self, now_s: float) -> None:
        """Look for a controller if there is none and it is time. NoDriverError where looking is of no use."""
        if self.state is ConnectionState.CONNECTED or self._closed:
            return
        found = self._search.take()
        if isinstance(found, OpenController):
            self._connect(found, now_s)
            return
        if isinstance(found, NoDriverError):
            raise found
        if isinstance(found, NoDeviceError):
            if self.state is not ConnectionState.LOST:  # that it is gone has been said
                self._say_once(f"{found}; waiting for one")
        elif found is not None:
            # The system gives permission a moment after the controller appears: once is no trouble yet.
            if str(found) == self._refused:
                self._say_once(f"{found}; trying again until it works")
            self._refused = str(found)
        if self._next_look_s is None or now_s >= self._next_look_s:
            self._next_look_s = now_s + LOOK_PERIOD_S
            self._search.begin(self._address)

    def beat(self, now_s: float) -> None:
        """While an effect is on, show the watchdog that we live; to be called at every turn, before what is written.

        After a long silence the watchdog may have released the triggers. Then the listener hears of a controller that
        has just been found. A write that does not return is a silence, too.
        """
        if self._guard is None or self.controller is None or not self._held:
            return
        if self.controller.device.released:
            if self._beat_s is not None:
                self._beat_s = None
                self._guard.rest()
            return
        silence_s = 0.0 if self._beat_s is None else now_s - self._beat_s
        if self._beat_s is not None and silence_s < BEAT_PERIOD_S:
            return
        silent = silence_s > RETELL_AFTER_S
        if self.controller.stalls(now_s):
            if silent:
                self._say_once("a write to the controller does not return; until it does, its triggers are released")
            return
        self._beat_s = now_s
        self._guard.beat()
        if silent:
            self._listener.controller_found(now_s)

    def read(self, now_s: float) -> ControllerState | None:
        """The newest state; None without a new one, or without a controller."""
        if self.controller is None:
            return None
        try:
            return self.controller.device.read(now_s)
        except DeviceError as error:
            self._lose(error, now_s)
            return None

    def write(self, feel: Feel, now_s: float) -> bool:
        """Tell the controller, if there is one; whether it went out."""
        if self.controller is None:
            return False
        if self._guard is not None and self._held and self._beat_s is None:
            self._beat_s = now_s  # before the effect is on: we may hang at once
            self._guard.beat()
        try:
            self.controller.device.write(feel, now_s)
        except DeviceError as error:
            self._lose(error, now_s)
            return False
        return True

    def take_notes(self) -> list[str]:
        """Notes for a person since the last call; each trouble appears once, however long it lasts."""
        notes, self._notes = self._notes, []
        return notes

    def close(self) -> None:
        """Release the triggers and let the controller go; nothing is looked for any more. Safe to call again."""
        if self._closed:
            return
        self._closed = True
        try:
            self._search.close()
        finally:
            self._let_go()

    def _connect(self, controller: OpenController, now_s: float) -> None:
        # Before anything is written to it.
        self._held, self._beat_s = False, None
        if self._guard is not None and controller.path is not None:
            self._held = True
            self._guard.hold(controller.path, controller.release)
        known, self._address = self._address, controller.address
        self.controller = controller
        self.state = ConnectionState.CONNECTED
        self.found += 1
        self._said.clear()
        self._refused = None
        self._notes.append(_introduction(controller, known, first=self.found == 1))
        self._listener.controller_found(now_s)

    def _lose(self, error: DeviceError, now_s: float) -> None:
        self.state = ConnectionState.LOST
        self._next_look_s = now_s + LOOK_PERIOD_S
        self._say_once(
            f"{error}; until it is back nothing is sent to move the robot, which stops: then release the triggers and"
            " arm it anew"
        )
        self._listener.controller_lost(now_s)
        self._let_go()

    def _let_go(self) -> None:
        controller, self.controller = self.controller, None
        if controller is None:
            return
        controller.device.close()
        self.released = controller.device.released
        # A controller that could not be released stays with the watchdog, which will try once more when we end.
        if self.released and self._guard is not None:
            self._guard.let_go()

    def _say_once(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._notes.append(text)


def _introduction(controller: OpenController, known: str | None, *, first: bool) -> str:
    """Name the controller, and say whether it is the one from before, whose address is `known`."""
    if first or known is None or controller.address is None:
        return f"controller: {controller.name}"  # nobody can tell whether it is the same
    if controller.address == known:
        return f"controller: {controller.name}, back again"
    return f"another controller: {controller.name}"
