"""The process `feelahead-operator`: sockets, clock, controller, core; nothing else."""

import functools
import secrets
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any, NamedTuple

from common.clock import MonotonicClock, ThreadClock
from common.command.command_line import given_fields, parse_settings
from common.command.ending import end_with, failure_of
from common.command.live_view import Value
from common.command.status import Status
from common.command.stop_signal import LeavingAtOnce, StopSignal
from common.emulation.spec import unused_clauses
from common.realtime.garbage import IdleCollection
from common.realtime.keeping_up import KeepingUp
from common.realtime.pacing import Pacer, wait_for_turn
from common.realtime.priority import make_realtime, raise_priority
from common.realtime.stages import Stages
from common.recording.side import SideRecording, recording_to
from common.silence import MOTION_PERIOD_S
from common.sockets.authentication import OperatorKeys
from common.sockets.operator import OperatorSockets
from operator_side.controller.connection import Connection
from operator_side.controllers import DEVICES, Given
from operator_side.core import OperatorSide
from operator_side.dualsense.hid.device import HidBackend
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.recorded import OperatorEncoder, build_recorded, recorded_status
from operator_side.robot_link.commanding import ToRobot
from operator_side.robot_link.sending import Sending
from operator_side.settings import OperatorSettings
from operator_side.stored_travel import StoredTravel
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts_of_core import Surroundings
from operator_side.viewing.following_pages import follow_pages, hands_facts
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.pages.shared_hands import Hands
from operator_side.viewing.terminal.status import TerminalStatus
from operator_side.viewing.viewing import Viewing, view_topics

_HELPS = {
    "sockets": "a slower link",
    "messages": "a slower link",
    "feeling": "--no-haptics",
    "hands": "another controller",
    "": "a page of the console fewer, or a faster machine,",
}
"""The stages of a turn, and what makes each of them shorter: sending and receiving; taking in what arrived; what the
controller is told; what is read from it, and commands. "": all else, such as what is shown."""
_GUARD_PERIOD_S = 0.5
"""From one look at the watchdog to the next."""


def command(arguments: Sequence[str], backend: HidBackend | None = None) -> int:
    """Run the operator side until --duration, Ctrl-C or SIGTERM; the triggers are released on every way out.

    A real controller need not be there: it is waited for, and so is one that was unplugged. `backend`: hidapi
    unless given.
    """
    settings = parse_settings(OperatorSettings, "feelahead-operator", arguments)
    link = settings.link_spec()
    keys = None if settings.keys is None else OperatorKeys.load(settings.keys, settings.robot_key)
    leaving = LeavingAtOnce(settings.summary)
    with (
        OperatorSockets(
            settings.connect,
            settings.view_connect,
            topics=view_topics(settings),
            keys=keys,
            connections=settings.connections,
        ) as sockets,
        StopSignal() as stop,
        TerminalStatus("operator") if settings.tui else Status(settings.status, "operator") as status,
        recording_to(settings.record, "operator", OperatorEncoder()) as recording,
    ):
        leaving.summary = None
        sending = Sending(link, sockets)
        core = build_recorded(settings, secrets.randbits(53), recording)
        if recording is not None:
            status.also = recording.note
        for text in unused_clauses(link, [("to_robot", "haptics")]):
            status.note(text)
        with ExitStack() as stack:
            pages = DrivingPage()
            search, guard, person = DEVICES[settings.device](Given(settings, core, pages, backend))
            pages.may_drive = person is not None
            if guard is not None:
                stack.enter_context(guard)
            connection = Connection(search, core, guard)
            stack.callback(connection.close)
            # The console before our own priority is raised, which it would inherit.
            viewing = Viewing(
                core,
                lambda now_s: Surroundings(
                    "controller" if person is None else person.hands,
                    sending.asked,
                    settings.swap_sides,
                    hands_facts(pages, person, core, now_s),
                ),
                *(status, pages, _console(settings, stack), recording),
            )
            raise_priority()
            for text in make_realtime() if settings.realtime else ():
                status.note(text)
            given = "calibration" in given_fields(arguments, OperatorSettings)
            people = _People(person, pages, viewing)
            travel = None if given else StoredTravel(connection, core, viewing.note)
            loop = _Loop(settings, core, sending, sockets, connection, guard, people, status, travel)
            loop.recording = recording
            failure = failure_of(functools.partial(loop.run, stop))
        kept = {} if recording is None else {"recording": recording.close()}
        summary = core.summary() | loop.summary() | {"triggers_released": connection.released} | kept
        end_with(summary, settings.summary, failure)
    return 0


def _console(settings: OperatorSettings, stack: ExitStack) -> Console | None:
    if not settings.console:
        return None
    return stack.enter_context(Console(settings.connect, port=settings.console_port))


class _People(NamedTuple):
    """The people at this side, besides a real controller's hands."""

    person: Hands | None
    pages: DrivingPage
    viewing: Viewing


class _Loop:
    """Motion at absolute deadlines, messages and effects as they come."""

    def __init__(
        self,
        settings: OperatorSettings,
        core: OperatorSide,
        sending: Sending,
        sockets: OperatorSockets,
        connection: Connection,
        guard: ReleaseGuard | None,
        people: "_People",
        status: Status,
        travel: StoredTravel | None,
    ) -> None:
        """`travel`: takes on the calibration that is stored for a controller; None where one was given."""
        self.recording: SideRecording | None = None
        """The recording of the run"""
        self._travel = travel
        self._duration_s = settings.duration
        self._core = core
        self._sending = sending
        self._sockets = sockets
        self._connection = connection
        self._guard = guard
        self._guard_s = 0.0
        self._person, self._pages, self._viewing = people
        self._status = status
        self._clock = MonotonicClock()
        self._collection = IdleCollection(self._clock)
        self._start_s = self._clock.now()
        self._pacer = Pacer(MOTION_PERIOD_S, self._start_s, settings.seed)
        computed = ThreadClock()
        self._stages = Stages(tuple(filter(None, _HELPS)), self._clock, computed, settings.seed)
        self._keeping_up = KeepingUp(self._pacer, self._stages, self._clock, computed, _HELPS)

    def run(self, stop: StopSignal) -> None:
        """Go on until `stop` or --duration."""
        with self._collection:
            self._start_s = self._clock.now()
            self._pacer.restart(self._start_s)
            timed = self._stages.timed
            receive, see = timed("sockets", self._sockets.receive), timed("sockets", self._sockets.receive_view)
            take, send, move = timed("messages", self._take), timed("sockets", self._send), timed("hands", self._move)
            feel = timed("feeling", self._feel)
            while not stop.is_set:
                self._keeping_up.begin()
                received, seen = receive(), see()
                # Read after receiving: what waited while this process was stopped is as old as it is.
                now_s = self._clock.now()
                if self._duration_s is not None and now_s - self._start_s >= self._duration_s:
                    break
                take(received, seen, now_s)
                feel(now_s)
                moved = self._pacer.due(now_s)
                if moved:
                    move(now_s)
                send()
                if moved:
                    self._use_idle_time(self._clock.now())
                if (said := self._keeping_up.end(turned=moved)) is not None:
                    self._viewing.note(said)
                wait_for_turn(self._pacer, self._clock, self._sockets.wait, self._sending.next_due())

    def _take(self, received: Sequence[bytes], seen: Sequence[tuple[bytes, bytes]], now_s: float) -> None:
        for payload in received:
            self._core.receive(payload, now_s)
        for topic, payload in seen:
            if not self._viewing.take(topic, payload):
                self._core.receive_view(payload, now_s)

    def _feel(self, now_s: float) -> None:
        self._connection.beat(now_s)
        if (feel := self._core.feel_now(now_s)) is not None:
            self._connection.write(feel, now_s)

    def _send(self) -> None:
        if not self._sending.send(self._clock.now()):
            self._core.held_command.forget()

    def summary(self) -> dict[str, Any]:
        """The process's part of the run's figures."""
        return {
            "controller": {"found": self._connection.found, "state": str(self._connection.state)},
            "stages": {"operator": self._stages.summary()},
            "machine": {"operator": self._keeping_up.summary()},
            "pacing": {"operator": self._pacer.summary() | {"garbage": self._collection.summary()}},
            **self._sending.summary(),
            "pages": {"rejected": self._pages.rejected, "stale": self._pages.stale, "silences": self._pages.silences},
        }

    def _move(self, now_s: float) -> None:
        self._pacer.begin(now_s)
        follow_pages(self._pages, self._core, now_s)
        # Before anything else is sent: the wish arrives after all that took the old way.
        if (words := self._core.tuner.take_link()) is not None:
            self._sending.tune(words)
        if self._person is not None:
            self._person.tick(now_s, self._core.screen, self._core.link.round_trip.mean or 0.0)
        self._connection.update(now_s)
        self._say_what_is_new()
        if self._travel is not None:
            self._travel.follow()
        if (state := self._connection.read(now_s)) is not None:
            self._core.read_state(state, now_s)
        self._sending.push([*self._core.motion(now_s), *map(ToRobot, self._viewing.requests(now_s))], now_s)
        self._sending.measure(self._core.link.outgoing, now_s)

    def _say_what_is_new(self) -> None:
        for text in self._connection.take_notes():
            self._viewing.note(text)

    def _use_idle_time(self, now_s: float) -> None:
        """Do all that no message should wait for."""
        if self.recording is not None:
            for text in self.recording.idle(now_s, lambda: recorded_status(self._core, now_s)):
                self._viewing.note(text)
        self._say_what_is_new()
        if self._guard is not None and now_s >= self._guard_s:
            self._guard_s = now_s + _GUARD_PERIOD_S
            for text in self._guard.take_notes():
                self._viewing.note(text)
        shows, tells = self._viewing.facts_due(now_s), self._status.due(now_s)
        values = self._values(now_s) if shows or tells else {}
        if shows:
            self._viewing.show(values, now_s)
        if tells:
            self._viewing.tell(values, now_s)
        stiffness = self._core.stiffness
        self._collection.idle(now_s, resting=stiffness is None or stiffness.state != "armed")

    def _values(self, now_s: float) -> dict[str, Value]:
        """The values that a person sees."""
        values: dict[str, Value] = dict(self._core.status(now_s))
        if self._sockets.trouble is not None and values.get("link") != "up":
            values["link"] = self._sockets.trouble
        values["controller"] = self._connection.state
        controller = self._connection.controller
        values["triggers_released"] = None if controller is None else controller.device.released
        if self._person is not None:
            values["person"] = self._person.doing
        values["motion_overruns"] = self._pacer.overruns
        values["queue_to_robot_ms"] = self._sending.queue_ms
        return values
