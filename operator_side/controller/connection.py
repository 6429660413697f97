"""Connection to a controller: search for one, notice its loss, search again.

It has no I/O or clock of its own: the search that opens a controller and `now_s` are arguments.
"""

from typing import Final, Protocol

from common.errors import DeviceError, NoDeviceError, NoDriverError
from common.status.codes import ConnectionState
from operator_side.controller.feel import Feel
from operator_side.controller.port import OpenController
from operator_side.controller.search import BackgroundSearch
from operator_side.controller.silence import SILENT_S, Silence
from operator_side.controller.state import ControllerState

BEAT_PERIOD_S: Final = 0.05
"""Seconds between beats to the watchdog while an effect is on"""
REWRITE_AFTER_S: Final = 0.1
"""Seconds between two beats above which effects are written again, as the watchdog may have released the triggers.

Half the watchdog's limit: if it has released them, one of two consecutive gaps was longer than this, even if the
process was suspended between reading the clock and the beat."""
LOOK_PERIOD_S: Final = 1.0
"""Seconds between searches, and from a loss to the next search: by then the arm has long stopped"""

_REVIVAL: Final = "press its PS button, bring it nearer, or plug it in again"
"""Remedies for a silent controller"""
WITHOUT_ONE: Final = (
    "the robot stops, and no commands are sent until the controller is back: then release its triggers and arm again"
)


class Listener(Protocol):
    """Receiver of events: a controller was found or lost."""

    def controller_found(self, now_s: float) -> None:
        """Note that a controller was found, or its effects may have been released: its triggers' state is unknown."""

    def controller_lost(self, now_s: float) -> None:
        """Note that the controller was lost."""


class Guard(Protocol):
    """Watchdog that releases a controller when this process is killed or hangs."""

    def hold(self, path: bytes, release: bytes) -> None:
        """Let the watchdog write `release` to the controller at `path` if this process dies or hangs from now on."""

    def let_go(self) -> None:
        """Cancel `hold`."""

    def beat(self) -> None:
        """Report that an effect is on and this process runs; it counts as hanging if no beat or `rest` follows."""

    def rest(self) -> None:
        """Report that no effect is on, so that no beat is due."""


class Connection:
    """Connection to one controller at a time. No method waits; only `update` raises, and only NoDriverError."""

    def __init__(
        self, search: BackgroundSearch, listener: Listener, guard: Guard | None = None, meanwhile: str = WITHOUT_ONE
    ) -> None:
        """meanwhile: what the note of a loss says about the time until the controller is back."""
        self.state = ConnectionState.ABSENT
        self.found = 0
        """Number of times that a controller was found."""
        self.released = True
        """Whether the last closed controller had its triggers released; False if it was unplugged with an effect on."""
        self.controller: OpenController | None = None
        """Connected controller; None without one."""
        self._search = search
        self._listener = listener
        self._guard, self._meanwhile = guard, meanwhile
        self._silence = Silence()
        self._held = False
        self._beat_s: float | None = None
        self._address: str | None = None
        self._next_look_s: float | None = None
        self._refused: str | None = None
        self._said: set[str] = set()
        self._notes: list[str] = []
        self._closed = False

    def update(self, now_s: float) -> None:
        """Search for a controller if none is connected and a search is due. NoDriverError if searching is useless."""
        if self.state is ConnectionState.CONNECTED or self._closed:
            return
        found = self._search.take()
        if isinstance(found, OpenController):
            self._connect(found, now_s)
            return
        if isinstance(found, NoDriverError):
            raise found
        if isinstance(found, NoDeviceError):
            if self.state is not ConnectionState.LOST:  # the loss has been reported
                self._say_once(f"{found}; waiting for a controller")
        elif found is not None:
            # The system grants permission a moment after a controller appears, so a single failure is not reported.
            if str(found) == self._refused:
                self._say_once(f"{found}; opening it is tried again until it works")
            self._refused = str(found)
        if self._next_look_s is None or now_s >= self._next_look_s:
            self._next_look_s = now_s + LOOK_PERIOD_S
            self._search.begin(self._address)

    def beat(self, now_s: float) -> None:
        """Send a beat to the watchdog if one is due; call it in every turn of the loop, before a write.

        After a gap longer than REWRITE_AFTER_S the watchdog may have released the triggers: the listener then gets
        `controller_found`, so that effects are written again. While a write does not return, no beat is sent.
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
        silent = silence_s > REWRITE_AFTER_S
        if self.controller.stalls(now_s):
            if silent:
                self._say_once(
                    "the controller accepts no data: a write hangs; until it returns, the triggers are released"
                )
            return
        self._beat_s = now_s
        self._guard.beat()
        if silent:
            self._listener.controller_found(now_s)

    def read(self, now_s: float) -> ControllerState | None:
        """Return the controller's newest state; None without a new state, or without a controller.

        A controller that gives no new state for SILENT_S is lost, too.
        """
        if self.controller is None:
            return None
        try:
            state = self.controller.device.read(now_s)
            if self._silence.lasts(now_s, heard=state is not None):
                raise DeviceError(f"the controller is gone (no new report for {SILENT_S:g} s): {_REVIVAL}")
        except DeviceError as error:
            self._lose(error, now_s)
            return None
        return state

    def write(self, feel: Feel, now_s: float) -> bool:
        """Write to the controller; return False if there is none, or if it was lost by this write."""
        if self.controller is None:
            return False
        if self._guard is not None and self._held and self._beat_s is None:
            self._beat_s = now_s  # before the effect is on, as this process may hang during the write
            self._guard.beat()
        try:
            self.controller.device.write(feel, now_s)
        except DeviceError as error:
            self._lose(error, now_s)
            return False
        return True

    def take_notes(self) -> list[str]:
        """Return the notes since the last call, for the status; a trouble that lasts is noted once."""
        notes, self._notes = self._notes, []
        return notes

    def close(self) -> None:
        """Release the triggers, close the controller and end the search. Safe to call again."""
        if self._closed:
            return
        self._closed = True
        try:
            self._search.close()
        finally:
            self._let_go()

    def _connect(self, controller: OpenController, now_s: float) -> None:
        # Hold it before the first write.
        self._held, self._beat_s, self._silence = False, None, Silence()
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
        self._say_once(f"{error}; {self._meanwhile}")
        self._listener.controller_lost(now_s)
        self._let_go()

    def _let_go(self) -> None:
        controller, self.controller = self.controller, None
        if controller is None:
            return
        controller.device.close()
        self.released = controller.device.released
        # The watchdog keeps a controller that could not be released, and tries once more when this process ends.
        if self.released and self._guard is not None:
            self._guard.let_go()

    def _say_once(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._notes.append(text)


def _introduction(controller: OpenController, known: str | None, *, first: bool) -> str:
    """Make the note for a found controller. known: address of the controller before it, None if unknown."""
    if first or known is None or controller.address is None:
        return f"controller: {controller.name}"  # unknown whether it is the same as before
    if controller.address == known:
        return f"controller: {controller.name}, back again"
    return f"another controller: {controller.name}"
