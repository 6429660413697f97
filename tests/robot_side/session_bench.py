"""Robot side in virtual time, with operators that the test controls; each message arrives at once."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from common.arrays import FloatArray
from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import (
    Header,
    Hello,
    LeaseNotice,
    LinkReport,
    Mark,
    MotionCommand,
    StiffnessUpdate,
    Telemetry,
    Tune,
    Watch,
)
from common.protocol.session import SessionState
from robot_side.arm.port import ArmState
from robot_side.core.robot_parts import RobotParts
from robot_side.core.robot_side import RobotSide
from robot_side.operators.safety import SafetySettings
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.tick.events import Listener, Tick

TICK_S = 0.001
COMMAND_PERIOD_TICKS = 4
_HELLO_PERIOD_TICKS = 200
QUICK = RobotSettings(safety=SafetySettings(healthy_s=0.1))
"""Settings with which the arm can be armed after 0.1 s of commands: a longer time would test nothing more"""
CRUISE = 0.4
"""Travel of R2 at which the built-in arm advances at 0.1 m/s."""


class ArmWatch(Listener):
    """Listener that notes commands to the arm and the arm's measured speed."""

    def __init__(self) -> None:
        self.speeds_rad_s: list[tuple[float, float]] = []
        """(time, speed of the fastest joint) of each state"""
        self.told_to_move = 0
        """Number of commands to move, with a joint velocity other than 0"""

    def on_tick(self, tick: Tick) -> None:
        if tick.measured is not None:
            self.note(tick.measured)
        if tick.found is not None and tick.found.commanded_rad_s is not None:
            self.told_to_move += bool(np.any(tick.found.commanded_rad_s))

    def note(self, state: ArmState) -> None:
        if not self.speeds_rad_s or state.time_s > self.speeds_rad_s[-1][0]:
            self.speeds_rad_s.append((state.time_s, float(np.abs(state.joint_velocities_rad_s).max())))


class Operator:
    def __init__(self, epoch: int, peer: bytes) -> None:
        self.link = LinkEnd("operator", epoch, "clock")
        self.peer = peer
        self.notice: LeaseNotice | None = None
        self.inbox: list[StiffnessUpdate | Hello | LeaseNotice] = []

    @property
    def token(self) -> int:
        """Token of the lease by the newest notice; 0 before the first."""
        return 0 if self.notice is None else self.notice.token

    @property
    def state(self) -> SessionState:
        return SessionState.UNKNOWN if self.notice is None else self.notice.session

    @property
    def updates(self) -> list[StiffnessUpdate]:
        return [message for message in self.inbox if isinstance(message, StiffnessUpdate)]

    def receive(self, message: StiffnessUpdate | Hello | LeaseNotice, now_s: float) -> None:
        self.inbox.append(message)
        arrival = self.link.arrived(message, now_s)
        if isinstance(message, LeaseNotice) and arrival.fresh:
            self.notice = message

    def command(self, now_s: float, header: Header | None = None, **fields: Any) -> bytes:
        """Return a motion command with released triggers and pressed hold-to-run; `fields` replace its values."""
        content: dict[str, Any] = {"l2": 0.0, "r2": 0.0, "run": True, "token": self.token} | fields
        return encode(MotionCommand(header or self.link.stamp(now_s), **content))


class Bench:
    """Robot side under test, its operators, and a record of the arm's motion."""

    def __init__(
        self, settings: RobotSettings = QUICK, parts: RobotParts | None = None, listeners: Sequence[Listener] = ()
    ) -> None:
        self.watch = ArmWatch()
        parts = parts or build_parts(settings, 1, "clock")
        self.arm, self.robot = parts.arm, RobotSide(parts, [self.watch, *listeners])
        self.ticks = 0
        self.operators: dict[bytes, Operator] = {}
        self.views: list[Telemetry] = []

    @property
    def now_s(self) -> float:
        return self.ticks * TICK_S

    @property
    def state(self) -> str:
        return self.robot.session.safety.state

    @property
    def speed_rad_s(self) -> float:
        return self.watch.speeds_rad_s[-1][1]

    @property
    def tool_m(self) -> FloatArray:
        """Tick 25 times, so that telemetry comes; return the tool's position (3,) in it."""
        self.tick(25)
        return np.array(self.views[-1].tool_position_m)

    def operator(self, epoch: int, peer: bytes = b"operator") -> Operator:
        operator = self.operators[peer] = Operator(epoch, peer)
        return operator

    def join(self, epoch: int, peer: bytes = b"operator") -> Operator:
        operator = self.operator(epoch, peer)
        self.say_hello(operator)
        self.tick()
        return operator

    def say_hello(self, operator: Operator) -> None:
        self.robot.receive(operator.peer, encode(operator.link.hello(self.now_s)), self.now_s)

    def send(self, operator: Operator, **fields: Any) -> bytes:
        payload = operator.command(self.now_s, **fields)
        self.robot.receive(operator.peer, payload, self.now_s)
        return payload

    def tick(self, count: int = 1) -> None:
        """Tick `count` times, a millisecond each; the robot side's messages reach the operators at once."""
        for _ in range(count):
            self.ticks += 1
            for outgoing in self.robot.tick(self.now_s) + self.robot.observe(self.now_s):
                message = decode(outgoing.payload)
                if isinstance(message, Telemetry):
                    self.views.append(message)
                elif (operator := self.operators.get(outgoing.peer)) is not None and not isinstance(
                    message, MotionCommand | Watch | Tune | Mark | LinkReport
                ):
                    operator.receive(message, self.now_s)

    def silence(self, duration_s: float) -> None:
        self.tick(round(duration_s / TICK_S))

    def drive(self, duration_s: float, operator: Operator, **fields: Any) -> None:
        """Tick for `duration_s`, with a command each 4 ms; observers send a Hello each 200 ms."""
        for step in range(round(duration_s / TICK_S)):
            self.tick()
            if step % COMMAND_PERIOD_TICKS == 0:
                self.send(operator, **fields)
            if step % _HELLO_PERIOD_TICKS == 0:
                for other in self.operators.values():
                    if other is not operator and other.state is SessionState.OBSERVING:
                        self.say_hello(other)

    def arm_it(self, operator: Operator) -> None:
        """Command released triggers for the healthy time, then press the button; RuntimeError if that does not arm."""
        self.drive(self.robot.session.safety.settings.healthy_s + 0.05, operator)
        self.drive(0.02, operator, arm=True)
        if self.state != "armed":
            raise RuntimeError(f"the robot side is {self.state}; expected: armed")

    def cruise(self, operator: Operator, duration_s: float = 0.3) -> None:
        self.arm_it(operator)
        self.drive(duration_s, operator, r2=CRUISE)
