"""Both sides in one process in virtual time: the cores, bytes and delay lines of the real sides, without sockets.

Events happen exactly when they are due, in order of time, so that the same settings and seed give the same
numbers on every machine.
"""

from typing import Any, Protocol

from common.clock import MonotonicClock, VirtualClock
from common.emulation.delay_line import DelayLine, link_summary
from common.emulation.spec import LinkSpec, Stream
from common.emulation.tuned import tuned_link
from common.protocol.messages import Telemetry
from common.statistics import RunningStatistics, microseconds
from feelahead.both_sides.summary import merge_summaries
from operator_side.controller.connection import Connection
from operator_side.controller.port import OpenController
from operator_side.controller.search import Ready
from operator_side.core import OperatorSide
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.settings import OperatorSettings
from operator_side.viewing.pages.driving_page import DrivingPage
from robot_side.core.robot_side import RobotSide
from robot_side.settings import RobotSettings

_WALL = MonotonicClock()
"""Real clock, only to measure how long ticks take."""
_PEER = b"loopback"
VIRTUAL_CLOCK = "virtual"
_STREAMS: tuple[Stream, ...] = ("haptics", "telemetry")
"""Streams to the operator side; pictures and scene are left out, as nobody watches views here."""


class Person(Protocol):
    """Person with the controller in their hands."""

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Look at the telemetry `screen`, and move the controller. delay_s: mean round trip, which the person knows."""


class Loopback:
    """Two cores, a controller with a person, and the link between the cores, on one virtual clock."""

    def __init__(
        self,
        robot: RobotSide,
        operator: OperatorSide,
        device: SimulatedDualSense,
        person: Person,
        robot_settings: RobotSettings,
        operator_settings: OperatorSettings,
        pages: DrivingPage | None = None,
        link: LinkSpec | None = None,
    ) -> None:
        """device: the controller, which the person holds. The settings have links, seeds and the turns' periods.

        pages: the console's pages, from which an emergency stop or tuning may come. link: instead of theirs.
        """
        self.clock = VirtualClock()
        self.robot, self.operator, self.device, self.person = robot, operator, device, person
        self.connection = Connection(Ready(OpenController(device, "simulated DualSense")), operator)
        self.pages = pages or DrivingPage(may_drive=False)
        self._tick_s, self._motion_s = robot_settings.tick_period_s(), operator_settings.tick_period_s()
        self.tick_time = RunningStatistics(robot_settings.seed)
        self._there, self._back = link or operator_settings.link_spec(), link or robot_settings.link_spec()
        self._to_robot: DelayLine[bytes] = DelayLine(self._there.profile("to_robot"))
        self._to_operator: dict[Stream, DelayLine[bytes]] = {
            stream: DelayLine(self._back.profile("to_operator", stream)) for stream in _STREAMS
        }
        self._ticks = 0
        self._motions = 0

    def run_until(self, end_s: float) -> None:
        """Advance the virtual clock to `end_s`, and process all events until then."""
        while (due_s := self._next_event()) <= end_s:
            self.clock.advance_to(due_s)
            self._deliver(due_s)
            if due_s >= self._motions * self._motion_s:
                self._motions += 1
                self._operator_tick(due_s)
            if due_s >= self._ticks * self._tick_s:
                self._ticks += 1
                self._robot_tick(due_s)
            self._deliver(due_s)
            if (feel := self.operator.feel_now(due_s)) is not None:
                self.connection.write(feel, due_s)
        self.clock.advance_to(end_s)

    def summary(self) -> dict[str, Any]:
        """Return a summary like the demo's; only its tick times are in real time, and so differ from run to run."""
        merged = merge_summaries(self.robot.summary(), self.operator.summary(), [])
        merged["duration_s"] = self.clock.now()
        merged["tick_us"] = microseconds(self.tick_time)
        merged["link"] = link_summary("to_robot", {"haptics": self._to_robot}) | link_summary(
            "to_operator", self._to_operator
        )
        return merged

    def _next_event(self) -> float:
        dues = [self._ticks * self._tick_s, self._motions * self._motion_s]
        dues += [due for line in (self._to_robot, *self._to_operator.values()) if (due := line.next_due()) is not None]
        # The clock must not go back for a message whose time has just passed.
        return max(min(dues), self.clock.now())

    def _deliver(self, now_s: float) -> None:
        for payload in self._to_robot.pop(now_s):
            self.robot.receive(_PEER, payload, now_s)
        for payload in self._to_operator["haptics"].pop(now_s):
            self.operator.receive(payload, now_s)
        for payload in self._to_operator["telemetry"].pop(now_s):
            self.operator.receive_view(payload, now_s)

    def _operator_tick(self, now_s: float) -> None:
        self.pages.apply(self.operator, now_s)
        if (words := self.operator.tuner.take_link()) is not None:
            self._there = tuned_link(self._there, words)
            self._to_robot.change(self._there.profile("to_robot"))
        self.person.tick(now_s, self.operator.screen, self.operator.link.round_trip.mean or 0.0)
        self.connection.update(now_s)
        if (state := self.connection.read(now_s)) is not None:
            self.operator.read_state(state, now_s)
        for message in self.operator.motion(now_s):
            self._to_robot.push(now_s, message.payload)

    def _robot_tick(self, now_s: float) -> None:
        start_s = _WALL.now()
        outgoing = self.robot.tick(now_s)
        self.tick_time.add(_WALL.now() - start_s)
        for message in outgoing + self.robot.observe(now_s):
            self._to_operator[message.stream].push(now_s, message.payload)
        if (words := self.robot.session.tuning.take_link()) is not None:
            self._back = tuned_link(self._back, words)
            for stream, line in self._to_operator.items():
                line.change(self._back.profile("to_operator", stream))
