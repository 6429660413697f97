"""The two ends as they are between the law and the controller, and bare ones, which only send as many bytes as often.

The robot side's: sockets, admission, session, permission, loop age, header, codec and an emulated link without delay.
The operator side's: sockets, its core's receiving and commanding, and the same. Nothing is felt or rendered.
"""

import math
import secrets
from collections.abc import Iterator
from typing import Final, Protocol

from common.clock import MonotonicClock, clock_domain
from common.emulation.delay_line import DelayLine
from common.emulation.spec import LinkSpec
from common.protocol.link_end import LinkEnd
from common.protocol.uniform_field import FAR_M, uniform_field
from common.realtime.pacing import Pacer, wait_for_turn
from common.sockets.admission import Admission
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from common.timing.ages import LoopAge
from feelahead.benchmarks.link.peers import Link
from operator_side.core import OperatorSide
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from robot_side.ahead.law import Sensed
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Safety, SafetySettings
from robot_side.outgoing_messages import Outgoing, stiffness_message

BYTES: Final = {"robot": 460, "operator": 138}
"""Of what an end sends that has no protocol: as many as a stiffness update and a motion command."""
_REPORT_PERIOD_S: Final = 0.05
"""A controller that rests is read so often here: commands are made of what was read last."""


class End(Protocol):
    """One of two processes that exchange messages."""

    sent: int
    """Messages that left at once."""

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """Send at start_s + k period_s and take what comes, until `end_s`; the time of each turn, as it begins."""
        ...


class RobotEnd:
    """The robot side without arm, law and scene."""

    def __init__(self, sockets: RobotSockets) -> None:
        self.sent = 0
        self._sockets, self._clock = sockets, MonotonicClock()
        epoch = secrets.randbits(53)
        self._session = OperatorSession(lambda: LinkEnd("robot", epoch, clock_domain()), Safety(SafetySettings()))
        self._admission, self._loop_age = Admission(), LoopAge(0.2)
        self._line: DelayLine[Outgoing] = DelayLine(LinkSpec().profile("to_operator"))
        near, far = uniform_field(3), uniform_field(0)
        self._sensed = Sensed(near, far, 0.01, FAR_M, 0.0, 0.01, 1e-9)

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """As End."""
        sockets, session, line, clock = self._sockets, self._session, self._line, self._clock
        pacer = Pacer(period_s, start_s)
        while True:
            received = sockets.receive()
            now_s = clock.now()
            yield now_s
            if now_s >= end_s:
                return
            for peer, payload in self._admission.admitted(received, session.owner_peer):
                session.receive(peer, payload, now_s)
            if pacer.due(now_s):
                pacer.begin(now_s)
                self._admission.begin_tick()
                for message in self._tick(now_s):
                    line.push(now_s, message, len(message.payload))
            for message in line.pop(clock.now()):
                self.sent += sockets.send(message.peer, message.payload)
            wait_for_turn(pacer, clock, sockets.wait, line.next_due(), 0.0)

    def _tick(self, now_s: float) -> list[Outgoing]:
        session = self._session
        session.update(now_s)
        if session.take_owner_changed():
            self._loop_age.reset()
        if (age_s := session.loop_age_s(now_s)) is not None:
            self._loop_age.update(age_s, now_s)
        self._loop_age.value(now_s)
        state = session.permission(now_s).state
        outgoing = [Outgoing("haptics", answer.peer, answer.payload) for answer in session.take_answers(now_s)]
        if (owner := session.owner(now_s)) is not None:
            outgoing.append(stiffness_message(owner, self._sensed, 0.0, state))
        return outgoing


class OperatorEnd:
    """The operator side without a controller and without people who look."""

    def __init__(self, sockets: OperatorSockets) -> None:
        self.sent = 0
        self._sockets, self._clock = sockets, MonotonicClock()
        self._core = OperatorSide(secrets.randbits(53), clock_domain())
        self._line: DelayLine[bytes] = DelayLine(LinkSpec().profile("to_robot"))
        self._report = build_input_report(ControllerState())
        self._report_s = 0.0

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """As End."""
        sockets, core, line, clock = self._sockets, self._core, self._line, self._clock
        pacer = Pacer(period_s, start_s)
        while True:
            received, seen = sockets.receive(), sockets.receive_view()
            now_s = clock.now()
            yield now_s
            if now_s >= end_s:
                return
            for payload in received:
                core.receive(payload, now_s)
            for _, payload in seen:
                core.receive_view(payload, now_s)
            if pacer.due(now_s):
                pacer.begin(now_s)
                if now_s - self._report_s >= _REPORT_PERIOD_S:
                    self._report_s = now_s
                    core.read_report(self._report, now_s)
                for payload in core.motion(now_s):
                    line.push(now_s, payload)
            for payload in line.pop(clock.now()):
                self.sent += sockets.send(payload)
            wait_for_turn(pacer, clock, sockets.wait, line.next_due(), 0.0)


class BareEnd:
    """Who sends bytes, waits for bytes, and does nothing with them."""

    def __init__(self, link: Link, size_bytes: int) -> None:
        self.sent = 0
        self._link, self._payload, self._clock = link, bytes(size_bytes), MonotonicClock()

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """As End."""
        link, clock, due_s = self._link, self._clock, start_s
        while (now_s := clock.now()) < end_s:
            yield now_s
            if now_s >= due_s:
                self.sent += link.send(self._payload)
                # One that is late makes up for nothing, as the sides do.
                due_s += period_s * max(1, math.floor((now_s - due_s) / period_s))
            if link.wait(max(0.0, due_s - clock.now())):
                link.receive()
        yield now_s
