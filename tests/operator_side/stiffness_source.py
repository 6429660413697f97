"""Stand-in for a robot side: grants the lease and sends stiffness with strengths that the test sets."""

from common.clock import MonotonicClock, clock_domain
from common.errors import RemoteProtocolError
from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Hello, LeaseNotice, MotionCommand, MotionState
from common.protocol.session import SessionState
from common.realtime.pacing import Pacer, wait_for_turn
from common.sockets.robot import RobotSockets
from tests.helpers.felt import felt

TICK_PERIOD_S = 4e-3
"""Period of the stiffness messages, in seconds"""
_NOTICE_PERIOD_S = 0.05


class StiffnessSource:
    """Stand-in for a robot side, for one operator side on this machine, in real time."""

    def __init__(self) -> None:
        self.l2 = 0
        """Strength in every zone of L2, 0 to 8."""
        self.r2 = 0
        """Strength in every zone of R2, 0 to 8."""
        self.state: MotionState = "armed"
        self.commands = 0
        """Number of motion commands received."""
        self.hellos = 0
        self._clock = MonotonicClock()
        self._sockets = RobotSockets("tcp://127.0.0.1:0")
        self._link = LinkEnd("robot", 1, clock_domain())
        self._peer: bytes | None = None
        self._noticed_s = -1.0
        self._pacer = Pacer(TICK_PERIOD_S, self._clock.now())

    def __enter__(self) -> "StiffnessSource":
        return self

    def __exit__(self, *_: object) -> None:
        self._sockets.close()

    @property
    def address(self) -> str:
        """Endpoint of the control port."""
        return self._sockets.control_endpoint

    @property
    def view_address(self) -> str:
        """Endpoint of the view port; nothing is published."""
        return self._sockets.view_endpoint

    @property
    def connected(self) -> bool:
        """Return whether an operator side has sent a Hello."""
        return self._peer is not None

    def run(self, duration_s: float) -> None:
        """For `duration_s`, answer messages and send stiffness every 4 ms."""
        self._pacer.restart(self._clock.now())
        end_s = self._clock.now() + duration_s
        while (now_s := self._clock.now()) < end_s:
            self._receive(now_s)
            if self._pacer.due(now_s):
                self._pacer.begin(now_s)
                self._send(now_s)
            wait_for_turn(self._pacer, self._clock, self._sockets.wait)

    def _receive(self, now_s: float) -> None:
        for peer, payload in self._sockets.receive():
            try:
                message = decode(payload)
            except RemoteProtocolError:
                continue
            if isinstance(message, Hello):
                self.hellos += 1
                if peer != self._peer:
                    self._sockets.send(peer, encode(self._link.hello(now_s)))
                self._peer = peer
            if isinstance(message, Hello | MotionCommand):
                self._link.arrived(message, now_s)
            self.commands += isinstance(message, MotionCommand)

    def _send(self, now_s: float) -> None:
        if self._peer is None:
            return
        if now_s - self._noticed_s >= _NOTICE_PERIOD_S:
            self._noticed_s = now_s
            session = SessionState.ARMED if self.state == "armed" else SessionState.DISARMED
            notice = LeaseNotice(self._link.stamp(now_s), session=session, why="", token=1, waiting=0)
            self._sockets.send(self._peer, encode(notice))
        stiffness = felt(self._link.stamp(self._clock.now()), l2=self.l2, r2=self.r2, state=self.state)
        self._sockets.send(self._peer, encode(stiffness))
