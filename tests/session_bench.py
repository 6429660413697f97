"""A robot side in virtual time with operators in the test's hands; every message is delivered at once unless kept."""

from typing import Any

import numpy as np

from common.codec import decode, encode
from common.link_end import LinkEnd
from common.messages import Header, Hello, LeaseNotice, MotionCommand, StiffnessUpdate, Telemetry
from common.session import SessionState
from robot_side.assembly import build_robot_side
from robot_side.core import RobotSide
from robot_side.safety import SafetySettings
from robot_side.settings import RobotSettings

TICK_S = 0.001
COMMAND_PERIOD_TICKS = 4
HEALTHY_S = 0.1
QUICK = RobotSettings(safety=SafetySettings(healthy_s=HEALTHY_S))
"""Arms after a tenth of a second, because nobody learns anything from a longer one."""


class Operator:
    """One operator's end of the link."""

    def __init__(self, epoch: int, peer: bytes) -> None:
        self.link = LinkEnd("operator", epoch, "clock")
        self.peer = peer
        self.notice: LeaseNotice | None = None
        self.inbox: list[StiffnessUpdate | Hello | LeaseNotice] = []

    @property
    def token(self) -> int:
        return 0 if self.notice is None else self.notice.token

    @property
    def state(self) -> SessionState:
        return SessionState.UNKNOWN if self.notice is None else self.notice.session

    @property
    def felt(self) -> list[StiffnessUpdate]:
        return [message for message in self.inbox if isinstance(message, StiffnessUpdate)]

    def take(self, message: StiffnessUpdate | Hello | LeaseNotice, now_s: float) -> None:
        self.inbox.append(message)
        arrival = self.link.arrived(message, now_s)
        if isinstance(message, LeaseNotice) and arrival.fresh:
            self.notice = message

    def command(self, now_s: float, header: Header | None = None, **fields: Any) -> bytes:
        content: dict[str, Any] = {"l2": 0.0, "r2": 0.0, "run": True, "token": self.token} | fields
        return encode(MotionCommand(header or self.link.stamp(now_s), **content))


class Bench:
    """The robot side, what it sent to whom, and how fast its tool really moved."""

    def __init__(self, settings: RobotSettings = QUICK) -> None:
        self.robot: RobotSide = build_robot_side(settings, 1, "clock")
        self.ticks = 0
        self.operators: dict[bytes, Operator] = {}
        self.views: list[Telemetry] = []
        self.tool_speeds_m_s: list[tuple[float, float]] = []
        self.commanded_s: list[float] = []
        """When the arm was told to move."""

    @property
    def now_s(self) -> float:
        return self.ticks * TICK_S

    @property
    def state(self) -> str:
        return self.robot.session.safety.state

    def operator(self, epoch: int, peer: bytes = b"operator") -> Operator:
        operator = self.operators[peer] = Operator(epoch, peer)
        return operator

    def join(self, epoch: int, peer: bytes = b"operator") -> Operator:
        operator = self.operator(epoch, peer)
        self.say_hello(operator)
        return operator

    def say_hello(self, operator: Operator) -> None:
        self.robot.receive(operator.peer, encode(operator.link.hello(self.now_s)), self.now_s)

    def send(self, operator: Operator, **fields: Any) -> bytes:
        payload = operator.command(self.now_s, **fields)
        self.robot.receive(operator.peer, payload, self.now_s)
        return payload

    def tick(self, count: int = 1) -> None:
        for _ in range(count):
            self.ticks += 1
            for outgoing in self.robot.tick(self.now_s):
                message = decode(outgoing.payload)
                if isinstance(message, Telemetry):
                    self.views.append(message)
                elif (operator := self.operators.get(outgoing.peer)) is not None:
                    assert isinstance(message, StiffnessUpdate | Hello | LeaseNotice)
                    operator.take(message, self.now_s)
            if self.robot.session.permission(self.now_s).command is not None:
                self.commanded_s.append(self.now_s)
            assert self.robot._last is not None
            state, _ = self.robot._last
            pose = self.robot._kinematics.pose(state)
            speed = float(np.linalg.norm(pose.tool_jacobian[:3] @ state.joint_velocities_rad_s))
            self.tool_speeds_m_s.append((state.time_s, speed))

    def silence(self, duration_s: float) -> None:
        self.tick(round(duration_s / TICK_S))

    def drive(self, duration_s: float, operator: Operator, **fields: Any) -> None:
        """Ticks at 1 kHz with a command each 4 ms; those who wait say Hello each 200 ms."""
        for step in range(round(duration_s / TICK_S)):
            self.tick()
            if step % COMMAND_PERIOD_TICKS == 0:
                self.send(operator, **fields)
            if step % 200 == 0:
                for other in self.operators.values():
                    if other is not operator and other.state is SessionState.OBSERVING:
                        self.say_hello(other)

    def arm(self, operator: Operator) -> None:
        self.drive(self.robot.session.safety.settings.healthy_s + 0.05, operator)
        self.drive(0.02, operator, arm=True)
        assert self.state == "armed"

    @property
    def tool_m(self) -> np.ndarray:
        self.tick(25)
        return np.array(self.views[-1].tool_position_m)
