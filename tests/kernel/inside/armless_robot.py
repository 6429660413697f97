"""A robot side without an arm: its real sockets, lease and safety, and stiffness as the test says."""

import secrets
import threading
from types import TracebackType

from common.clock import MonotonicClock, clock_domain
from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Header, MotionState, StiffnessUpdate
from common.protocol.uniform_field import FAR_M, STRENGTHS, uniform_field
from common.sockets.robot import RobotSockets
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Safety, SafetySettings

_TICK_S = 0.02
SLOW_MACHINE = SafetySettings(gap_s=3.0, age_s=10.0, max_delay_s=20.0, healthy_s=0.3, lease_s=30.0)
"""A processor emulated in software holds no tenth of a second; what is checked is what follows, not how soon."""


class ArmlessRobot:
    """One life of it, in a thread."""

    def __init__(self) -> None:
        self.r2_stiffness = 0.0
        """0 to 1, wherever R2 is."""
        self.moving = False
        """Whether the arm, if there were one, would be told to move now."""
        self.state = "disarmed"
        self._sockets = RobotSockets("tcp://127.0.0.1:0", "tcp://127.0.0.1:0", heartbeat_timeout_s=30.0)
        epoch = secrets.randbits(53)
        self._session = OperatorSession(lambda: LinkEnd("robot", epoch, clock_domain()), Safety(SLOW_MACHINE))
        self._clock = MonotonicClock()
        self._ending = False
        self._thread = threading.Thread(target=self._live)

    def __enter__(self) -> "ArmlessRobot":
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending = True
        self._thread.join()
        self._sockets.close()

    @property
    def flags(self) -> list[str]:
        """How an operator side finds it."""
        return [f"--connect={self._sockets.control_endpoint}", f"--view-connect={self._sockets.view_endpoint}"]

    @property
    def commands(self) -> int:
        """Motion commands that have come."""
        return self._session.motion_received

    @property
    def has_operator(self) -> bool:
        """Whether anybody owns the lease."""
        return self._session.owner_peer is not None

    def _live(self) -> None:
        while not self._ending:
            received = self._sockets.receive()
            now_s = self._clock.now()
            for peer, payload in received:
                self._session.receive(peer, payload, now_s)
            self._session.update(now_s)
            permission = self._session.permission(now_s)
            self.state = permission.state
            self.moving = permission.command is not None and permission.command.r2 > 0.0
            for answer in self._session.take_answers(now_s):
                self._sockets.send(answer.peer, answer.payload)
            owner = self._session.owner(now_s)
            if owner is not None:
                self._sockets.send(owner.peer, encode(self._felt(owner.header, permission.state)))
            self._sockets.wait(_TICK_S)

    def _felt(self, header: Header, state: MotionState) -> StiffnessUpdate:
        return StiffnessUpdate(
            header,
            l2=uniform_field(0),
            r2=uniform_field(round(STRENGTHS * self.r2_stiffness)),
            speed_m_s=0.0,
            horizon_m=FAR_M,
            rumble=0.0,
            state=state,
        )
