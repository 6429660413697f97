"""Work of the operator side in each turn of its loop: the core, with sockets, controller and viewers around it."""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from msgspec.structs import replace

from common.loop.process import Process
from common.sockets.operator import OperatorSockets
from common.status.codes import InputSource, LinkState
from common.status.statuses import OperatorStatus
from operator_side.controller.connection import Connection
from operator_side.core import OperatorSide
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.dualsense.hid.second_writer import SecondWriters
from operator_side.robot_link.commanding import ToRobot
from operator_side.robot_link.sending import Sending
from operator_side.settings import OperatorSettings
from operator_side.stored_travel import StoredTravel
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts_of_core import Surroundings
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.viewing import Viewing

REMEDY: Final = "--no-haptics, a page of the console fewer, a slower link, or a faster machine"
"""Remedy to suggest if turns take too long"""
_GUARD_PERIOD_S: Final = 0.5
"""Seconds between checks of the watchdog"""


class Devices(NamedTuple):
    """Devices of the operator: a controller, and who uses it."""

    connection: Connection
    guard: ReleaseGuard | None
    """Watchdog of a real controller; None if there is none"""
    person: BrowserHands | None
    """Page or scripted person at the controller, called in every turn; None for a real controller"""
    pages: DrivingPage
    console: Console | None


class OperatorTurns:
    """Steps of a turn of the loop: receive, write effects, read the controller, send commands, display."""

    def __init__(
        self,
        settings: OperatorSettings,
        core: OperatorSide,
        desk: Devices,
        sockets: OperatorSockets,
        process: Process,
        *,
        stored_travel: bool,
    ) -> None:
        """stored_travel: whether to use the calibration that is stored for a controller."""
        self._process, self._core, self._sockets = process, core, sockets
        self._connection, self._guard, self._person, self._pages, console = desk
        self._sending = Sending(settings.link_spec(), sockets)
        self._pages.pictures.video_later_s = self._sending.video_later_s
        self._viewing = Viewing(
            core,
            self._surroundings,
            *(process.status, self._pages, console, process.recording),
        )
        self._travel = StoredTravel(self._connection, core, self._viewing.note) if stored_travel else None
        self.wait, self.next_due, self.note = sockets.wait, self._sending.line.next_due, self._viewing.note
        self._guard_s, self._second_writers = 0.0, SecondWriters()
        self._person_waits_s = settings.person_waits if console is not None else 0.0
        self._person_since_s: float | None = None
        """Time of the robot side's first telemetry; None before it"""

    @property
    def resting(self) -> bool:
        """Whether the arm is not armed, as far as is known."""
        stiffness = self._core.stiffness
        return stiffness is None or stiffness.state != "armed"

    def receive(self) -> tuple[Sequence[bytes], Sequence[tuple[bytes, bytes]]]:
        """Return the control and view messages that have arrived."""
        return self._sockets.receive(), self._sockets.receive_view()

    def handle(self, received: tuple[Sequence[bytes], Sequence[tuple[bytes, bytes]]], now_s: float) -> None:
        """Handle the messages, and write the resulting effects to the controller."""
        control, seen = received
        for payload in control:
            self._core.receive(payload, now_s)
        for topic, payload in seen:
            if not self._viewing.receive(topic, payload, now_s):
                self._core.receive_view(payload, now_s)
        self._connection.beat(now_s)
        if (feel := self._core.feel_now(now_s)) is not None:
            self._connection.write(feel, now_s)

    def turn(self, now_s: float) -> None:
        """Read the controller, and queue commands and requests."""
        core, connection = self._core, self._connection
        self._pages.apply(core, now_s)
        # First, so that the tuning request, sent over the new link, arrives after all messages of the old one.
        if (words := core.tuner.take_link()) is not None:
            self._sending.tune(words)
            self._pages.pictures.video_later_s = self._sending.video_later_s
        if self._person is not None:
            screen = core.screen if self._person_sees(now_s) else None
            self._person.tick(now_s, screen, core.link.round_trip.mean or 0.0)
        connection.update(now_s)
        self._say_what_is_new()
        if self._travel is not None:
            self._travel.load()
        if (state := connection.read(now_s)) is not None:
            core.read_state(state, now_s)
        self._sending.push([*core.motion(now_s), *map(ToRobot, self._viewing.requests(now_s))], now_s)
        self._sending.measure(core.link.outgoing, now_s)

    def send(self) -> None:
        """Send the messages that are due."""
        if not self._sending.send(self._process.loop.clock.now()):
            self._core.commands.held.forget()

    def rest(self, now_s: float, turned_s: float) -> None:
        """Do the less urgent work of a turn: record, check the watchdog, update the display."""
        del turned_s
        recording, status = self._process.recording, self._process.status
        if recording is not None:
            for text in recording.idle(now_s, lambda: self._core.status(now_s)):
                self.note(text)
        self._say_what_is_new()
        if self._guard is not None and now_s >= self._guard_s:
            self._guard_s = now_s + _GUARD_PERIOD_S
            for text in self._guard.take_notes():
                self.note(text)
        controller = self._connection.controller
        for text in self._second_writers.search(None if controller is None else controller.path, now_s):
            self.note(text)
        shows, tells = self._viewing.facts_due(now_s), status.due(now_s)
        if shows or tells:
            said = self._status(now_s)
            if shows:
                self._viewing.show(said, now_s)
            if tells:
                self._viewing.tell(said, now_s)

    def close(self) -> None:
        """Release the triggers and close the controller."""
        self._connection.close()

    def summary(self) -> dict[str, Any]:
        """Return the run's figures of the core, of sending and of the process."""
        pages = self._pages
        figures = {
            "controller": {"found": self._connection.found, "state": str(self._connection.state)},
            "triggers_released": self._connection.released,
            "pages": {"rejected": pages.rejected, "stale": pages.stale, "silences": pages.silences},
        }
        return self._core.summary() | self._sending.summary() | figures

    def _person_sees(self, now_s: float) -> bool:
        """Return whether a page has a picture, or the scripted person has waited long enough for one."""
        if self._person_since_s is None and self._core.screen is not None:
            self._person_since_s = now_s
        waited_s = -math.inf if self._person_since_s is None else now_s - self._person_since_s
        return self._viewing.has_shown_picture or waited_s >= self._person_waits_s

    def _say_what_is_new(self) -> None:
        for text in (*self._connection.take_notes(), *self._core.marker.take_notes()):
            self.note(text)

    def _surroundings(self, now_s: float) -> Surroundings:
        person = self._person
        page = self._pages.facts(self._core, now_s, person=person is not None and person.has_person)
        source = InputSource.CONTROLLER if person is None else person.source
        return Surroundings(source, self._sending.line.profile.words, page, self._pages.pictures.facts())

    def _status(self, now_s: float) -> OperatorStatus:
        """Return the core's status, completed with the fields that only the process knows."""
        controller, status = self._connection.controller, self._core.status(now_s)
        if (trouble := self._sockets.trouble) is not None and status.link is not LinkState.UP:
            link = LinkState.REFUSED if self._sockets.key_refused else status.link
            status = replace(status, link=link, link_reason=trouble)
        driven = self._person is not None and self._person.source is InputSource.BROWSER
        return replace(
            status,
            controller=self._connection.state,
            triggers_released=None if controller is None else controller.device.released,
            stop_reset=driven and self._pages.may_drive and not self._pages.reset_first,
            person=None if self._person is None else self._person.doing,
            motion_period_ms=1e3 * self._process.loop.pacer.period_s,
            motion_overruns=self._process.loop.pacer.overruns,
            queue_to_robot_ms=self._sending.queue_ms,
        )
