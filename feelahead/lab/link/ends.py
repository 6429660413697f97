"""Both sides' parts between law and controller, as the two ends of a link in real time.

These are sockets, admission, session, permission, loop age, codec, and a delay line without delay. Law, arm, rendering
and controller are left out.
"""

import secrets
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, Final

from common.clock import MonotonicClock, clock_domain
from common.emulation.delay_line import DelayLine
from common.emulation.spec import Direction, LinkSpec
from common.protocol.link_end import LinkEnd
from common.protocol.uniform_field import FAR_M, uniform_field
from common.realtime.pacing import Pacer, wait_for_turn
from common.sockets.door.admission import Admission
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from common.timing.ages import LoopAge
from operator_side.controller.state import ControllerState
from operator_side.core import OperatorSide
from operator_side.core_settings import CoreSettings
from operator_side.robot_link.commanding import ToRobot
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Safety, SafetySettings
from robot_side.reporting.outgoing_messages import stiffness_message
from robot_side.tick.outgoing import Outgoing
from robot_side.tick.sensed import Sensed

BYTES: Final = (169, 138)
"""Sizes in bytes of a stiffness update and of a motion command; bare ends send messages of these sizes."""
_REPORT_PERIOD_S: Final = 0.05
"""Period in seconds at which a simulated controller at rest reports; commands use the newest report."""


class _Side(ABC):
    """One of the two ends, which receives, ticks, and sends through a delay line."""

    def __init__(self, sockets: RobotSockets | OperatorSockets, direction: Direction) -> None:
        self.sent = 0
        self._wait = sockets.wait
        self._line: DelayLine[Any] = DelayLine(LinkSpec().profile(direction))

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """Receive, tick every `period_s` and send, until `end_s`; yield the time of each turn."""
        line, clock, pacer = self._line, MonotonicClock(), Pacer(period_s, start_s)
        while True:
            received = self._received()
            now_s = clock.now()
            yield now_s
            if now_s >= end_s:
                return
            self._take(received, now_s)
            if pacer.due(now_s):
                pacer.begin(now_s)
                self._tick(now_s)
            for message in line.pop(clock.now()):
                self.sent += self._send(message)
            wait_for_turn(pacer, clock, self._wait, line.next_due(), 0.0)

    @abstractmethod
    def _received(self) -> Any: ...

    @abstractmethod
    def _take(self, received: Any, now_s: float) -> None: ...

    @abstractmethod
    def _tick(self, now_s: float) -> None: ...

    @abstractmethod
    def _send(self, message: Any) -> bool: ...


class RobotEnd(_Side):
    """End of the robot side, without arm, law and scene."""

    def __init__(self, sockets: RobotSockets) -> None:
        super().__init__(sockets, "to_operator")
        self._sockets, epoch = sockets, secrets.randbits(53)
        self._session = OperatorSession(lambda: LinkEnd("robot", epoch, clock_domain()), Safety(SafetySettings()))
        self._admission, self._loop_age = Admission(), LoopAge(0.2)
        self._sensed = Sensed(l2=uniform_field(3), r2=uniform_field(0), speed_m_s=0.01, horizon_m=FAR_M)

    def _received(self) -> Any:
        return self._sockets.receive()

    def _take(self, received: Any, now_s: float) -> None:
        for peer, payload in self._admission.admitted(received, self._session.owner_peer, now_s):
            self._session.receive(peer, payload, now_s)

    def _tick(self, now_s: float) -> None:
        session = self._session
        session.update(now_s)
        if session.take_owner_changed():
            self._loop_age.reset()
        if (age_s := session.loop_age_s(now_s)) is not None:
            self._loop_age.update(age_s, now_s)
        self._loop_age.value(now_s)
        state = session.permission(now_s).state
        outgoing = [Outgoing("haptics", *answer) for answer in session.take_answers(now_s)]
        outgoing += [stiffness_message(owner, self._sensed, 0.0, state) for owner in session.owners(now_s)]
        for message in outgoing:
            self._line.push(now_s, message, len(message.payload))

    def _send(self, message: Outgoing) -> bool:
        return self._sockets.send(message.peer, message.payload, everywhere=message.everywhere)


class OperatorEnd(_Side):
    """End of the operator side, without a controller and without viewers."""

    def __init__(self, sockets: OperatorSockets) -> None:
        super().__init__(sockets, "to_robot")
        self._sockets, self._report_s = sockets, 0.0
        self._core = OperatorSide(secrets.randbits(53), clock_domain(), CoreSettings(full_rate=True))

    def _received(self) -> Any:
        return self._sockets.receive(), self._sockets.receive_view()

    def _take(self, received: Any, now_s: float) -> None:
        for payload in received[0]:
            self._core.receive(payload, now_s)
        for _, payload in received[1]:
            self._core.receive_view(payload, now_s)

    def _tick(self, now_s: float) -> None:
        if now_s - self._report_s >= _REPORT_PERIOD_S:
            self._report_s = now_s
            self._core.read_state(ControllerState(), now_s)
        for message in self._core.motion(now_s):
            self._line.push(now_s, message, len(message.payload))

    def _send(self, message: ToRobot) -> bool:
        return self._sockets.send(message.payload, everywhere=message.everywhere)
