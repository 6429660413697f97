"""Virtual controller inside the virtual machine, which a test plugs in, unplugs and operates."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeVar

from common.clock import MonotonicClock
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.uhid.controller import UhidController, UhidIdentity
from operator_side.dualsense.uhid.file import UhidFile, offer
from tests.helpers.machines.waiting import wait_until

Value = TypeVar("Value")


ADDRESS: Final = "01:02:03:04:05:06"


@dataclass(frozen=True, slots=True)
class Variant:
    """Model of a controller, and its transport: USB or Bluetooth."""

    transport: Transport
    model: Model = Model.DUALSENSE

    @property
    def name(self) -> str:
        """Name of model and transport, as messages show it."""
        return f"{self.model.title} on {self.transport.value}"


class Dongle(UhidController):
    """Virtual controller that repeats its last report while it is `off`, as a dongle does."""

    off = False
    _last: bytes | None = None

    def next_input(self, now_s: float) -> bytes | None:
        """Return the next input report's event; the last one again while the controller is off."""
        if self.off:
            return self._last if self.driven else None
        event = super().next_input(now_s)
        self._last = event or self._last
        return event


class Plugged:
    """Simulated controller, offered to the kernel through /dev/uhid by a thread while it is plugged in.

    While unplugged, it keeps its state, like a real controller that comes back before it loses power.
    """

    def __init__(self, variant: Variant) -> None:
        self.variant = variant
        self.identity = UhidIdentity(variant.transport, variant.model, ADDRESS)
        self._simulated = SimulatedDualSense(variant.transport, variant.model, address=ADDRESS)
        self.offered = Dongle(self._simulated, self.identity)
        self._asked: deque[Callable[[], None]] = deque()
        self._ending = False
        self._failure: BaseException | None = None
        self._thread: threading.Thread | None = None

    def __enter__(self) -> "Plugged":
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()

    def plug_in(self) -> None:
        """Plug the controller in; no effect if it is plugged in already."""
        if self._thread is not None:
            return
        self._ending = False
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    def unplug(self) -> None:
        """Unplug the controller; no effect if it is unplugged already. Raise the error with which its thread ended."""
        self._ending = True
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def ask(self, function: Callable[[SimulatedDualSense], Value]) -> Value:
        """Call `function` with the simulated controller in the controller's thread; return the result."""
        answers: deque[Value] = deque()
        thread = self._thread
        if thread is None:
            return function(self._simulated)
        self._asked.append(lambda: answers.append(function(self._simulated)))
        wait_until("the controller answers", lambda: bool(answers) or not thread.is_alive())
        if not answers:
            raise AssertionError(f"the controller has died: {self._failure!r}")
        return answers[0]

    def hands_off(self) -> None:
        """Release triggers, sticks and buttons."""

        def let_go(controller: SimulatedDualSense) -> None:
            controller.set_sticks()
            controller.set_buttons(frozenset())
            controller.set_finger_force(0.0, 0.0)

        self.ask(let_go)

    def _live(self) -> None:
        try:
            with UhidFile() as file:
                offer(file, self.offered, MonotonicClock(), 0.004, self._going)
        except BaseException as error:
            self._failure = error

    def _going(self, now_s: float) -> bool:
        del now_s
        while self._asked:
            self._asked.popleft()()
        return not self._ending
