"""Ends of a link in real time: whole ones, an emulated link's, and bare ones that send as many bytes as often.

Whole ends are the two sides between law and controller: sockets, admission, session, permission, loop age, codec and
a delay line without delay. Nothing is felt or rendered.
"""

import math
import secrets
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from common.clock import MonotonicClock, clock_domain
from common.emulation.delay_line import DelayLine
from common.emulation.spec import Direction, LinkSpec
from common.protocol.link_end import LinkEnd
from common.protocol.uniform_field import FAR_M, uniform_field
from common.realtime.pacing import Pacer, wait_for_turn
from common.sockets.admission import Admission
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from common.timing.ages import LoopAge
from feelahead.lab.link.bare import Link
from operator_side.core import OperatorSide
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from robot_side.ahead.law import Sensed
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Safety, SafetySettings
from robot_side.outgoing_messages import Outgoing, stiffness_message

BYTES: Final = (460, 138)
"""Sizes of a stiffness update and of a motion command: what bare ends send, the robot's first."""
HEADER: Final = struct.Struct("<qd")
"""Number and time of sending; the number −1 says hello, −2 that nothing more will come."""
_HELLO, _END = -1, -2
SETTLING_S: Final = 0.4
"""Sessions that fell asleep are there again after this time; a turn is measured from then on."""
PATIENCE_S: Final = 60.0
_REPORT_PERIOD_S: Final = 0.05
"""A controller that rests is read this often: commands are made of what was read last."""


@dataclass(frozen=True)
class Turn:
    """One turn of both ends."""

    seconds: float
    """Time measured, after settling."""
    period_s: float
    link: LinkSpec | None = None
    """The emulated link; None: no delay."""
    count: int = 0
    """Messages of the emulated link in each direction."""
    size_bytes: int = 0
    spin_s: float = 0.0


class _Steady:
    """An end that runs for some time; its share of a core and its messages a second are measured."""

    sent = 0

    def turn(self, start_s: float, turn: Turn) -> dict[str, float]:
        """Run from `start_s` on; measure after settling."""
        began: tuple[float, float, int] | None = None
        end_s, now_s = start_s + SETTLING_S + turn.seconds, start_s
        for now_s in self.run(start_s, end_s, turn.period_s):
            if began is None and now_s >= start_s + SETTLING_S:
                began = now_s, time.process_time(), self.sent
        began_s, before_s, sent = began or (start_s, 0.0, 0)
        passed_s = now_s - began_s
        return {"share": (time.process_time() - before_s) / passed_s, "sent_per_s": (self.sent - sent) / passed_s}

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """Send at start_s + k period_s and take what comes, until `end_s`; yield the time of each turn."""
        raise NotImplementedError


class _Side(_Steady):
    """One of the two sides: it takes what came, ticks, and sends by way of a delay line."""

    def __init__(self, sockets: RobotSockets | OperatorSockets, direction: Direction) -> None:
        self._wait = sockets.wait
        self._line: DelayLine[Any] = DelayLine(LinkSpec().profile(direction))

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """Run the part of the side's loop that talks to the other side."""
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

    def _received(self) -> Any:
        raise NotImplementedError

    def _take(self, received: Any, now_s: float) -> None:
        raise NotImplementedError

    def _tick(self, now_s: float) -> None:
        raise NotImplementedError

    def _send(self, message: Any) -> bool:
        raise NotImplementedError


class RobotEnd(_Side):
    """The robot side without arm, law and scene."""

    def __init__(self, sockets: RobotSockets) -> None:
        super().__init__(sockets, "to_operator")
        self._sockets, epoch = sockets, secrets.randbits(53)
        self._session = OperatorSession(lambda: LinkEnd("robot", epoch, clock_domain()), Safety(SafetySettings()))
        self._admission, self._loop_age = Admission(), LoopAge(0.2)
        self._sensed = Sensed(uniform_field(3), uniform_field(0), 0.01, FAR_M, 0.0, 0.01, 1e-9)

    def _received(self) -> Any:
        return self._sockets.receive()

    def _take(self, received: Any, now_s: float) -> None:
        for peer, payload in self._admission.admitted(received, self._session.owner_peer):
            self._session.receive(peer, payload, now_s)

    def _tick(self, now_s: float) -> None:
        session = self._session
        self._admission.begin_tick()
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
        for message in outgoing:
            self._line.push(now_s, message, len(message.payload))

    def _send(self, message: Outgoing) -> bool:
        return self._sockets.send(message.peer, message.payload)


class OperatorEnd(_Side):
    """The operator side without a controller and without people who look."""

    def __init__(self, sockets: OperatorSockets) -> None:
        super().__init__(sockets, "to_robot")
        self._sockets, self._report_s = sockets, 0.0
        self._core = OperatorSide(secrets.randbits(53), clock_domain())
        self._report = build_input_report(ControllerState())

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
            self._core.read_report(self._report, now_s)
        for payload in self._core.motion(now_s):
            self._line.push(now_s, payload)

    def _send(self, message: bytes) -> bool:
        return self._sockets.send(message)


class BareEnd(_Steady):
    """An end that sends bytes, waits for bytes, and does nothing with them."""

    def __init__(self, link: Link, size_bytes: int) -> None:
        self._link, self._payload = link, bytes(size_bytes)

    def run(self, start_s: float, end_s: float, period_s: float) -> Iterator[float]:
        """Send and receive."""
        link, clock, due_s = self._link, MonotonicClock(), start_s
        while (now_s := clock.now()) < end_s:
            yield now_s
            if now_s >= due_s:
                self.sent += link.send(self._payload)
                # A late end makes up for nothing, as the sides do.
                due_s += period_s * max(1, math.floor((now_s - due_s) / period_s))
            if link.wait(max(0.0, due_s - clock.now())):
                link.receive()
        yield now_s


class EmulatedEnd:
    """An end that sends numbered messages through a delay line, and notes what comes the other way."""

    def __init__(self, link: Link, direction: Direction) -> None:
        self._link, self._direction = link, direction

    def turn(self, start_s: float, turn: Turn) -> dict[str, Any]:
        """Send all messages; go on until both ends are through, or the other one has fallen silent."""
        link, clock = self._link, MonotonicClock()
        while clock.now() < start_s:  # the robot side can only answer a peer that has spoken
            if self._direction == "to_robot":
                link.send(HEADER.pack(_HELLO, 0.0))
            link.wait(0.05)
            link.receive()
        line: DelayLine[bytes] = DelayLine((turn.link or LinkSpec()).profile(self._direction))
        sent_s, received_s = [math.nan] * turn.count, [math.nan] * turn.count
        padding = bytes(max(0, turn.size_bytes - HEADER.size))
        before_s, pacer = time.process_time(), Pacer(turn.period_s, start_s)
        number = unsent = 0
        last_s, share = start_s + turn.count * turn.period_s + PATIENCE_S, math.nan
        arrived, peer_ended, ended = True, False, False
        while not (peer_ended and ended) and (now_s := clock.now()) <= last_s:
            # A drain costs more than all else, and is in vain when a deadline woke us.
            received = link.receive() if arrived else ()
            received_now_s = clock.now()
            for payload in received:
                place, _ = HEADER.unpack_from(payload)
                peer_ended |= place == _END
                if 0 <= place < turn.count and math.isnan(received_s[place]):
                    received_s[place] = received_now_s
            # A burst makes up for turns that were missed: every message is to be sent.
            while number < turn.count and now_s >= start_s + number * turn.period_s:
                sent_s[number] = now_s
                line.push(now_s, HEADER.pack(number, now_s) + padding, turn.size_bytes)
                number += 1
            if pacer.due(now_s):
                pacer.begin(now_s)
            for message in line.pop(clock.now()):
                unsent += not link.send(message)
            due_s = line.next_due()
            if due_s is None and number == turn.count and not ended:
                ended, last_s = True, now_s + 0.1 * PATIENCE_S
                share = (time.process_time() - before_s) / (clock.now() - start_s)
                for _ in range(100):  # a socket that is full of our messages refuses at first
                    if link.send(HEADER.pack(_END, now_s)):
                        break
                    link.wait(0.01)
            arrived = wait_for_turn(pacer, clock, link.wait, due_s, turn.spin_s)
        found = {"sent_s": np.array(sent_s), "received_s": np.array(received_s)}
        return found | {"line": line.summary(), "unsent": unsent, "share": share}
