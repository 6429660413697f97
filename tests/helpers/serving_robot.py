"""Robot side without an arm: real sockets and the real session, in a thread."""

import threading
from typing import Self

import msgpack

from common.clock import MonotonicClock
from common.protocol.codec import PROTOCOL_VERSION, encode
from common.protocol.link_end import LinkEnd
from common.sockets.authentication import RobotKeys
from common.sockets.robot import RobotSockets
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Safety, SafetySettings
from tests.helpers.messages import telemetry

LEASE_S = 59.0
"""Duration of a lease in seconds, so long that a silent owner keeps the lease"""


class ServingRobot:
    """Robot side in a thread, as a context: it answers messages and publishes telemetry, unless told otherwise."""

    def __init__(
        self,
        bind: str = "tcp://127.0.0.1:0",
        keys: RobotKeys | None = None,
        *,
        answers: bool = True,
        publishes: bool = True,
        version: int = PROTOCOL_VERSION,
        safety: SafetySettings | None = None,
    ) -> None:
        self.session = OperatorSession(
            lambda: LinkEnd("robot", 7, "a robot's"), Safety(safety or SafetySettings(lease_s=LEASE_S))
        )
        self.sockets = RobotSockets(bind, keys=keys, heartbeat_timeout_s=30.0)
        self.control, self.view = self.sockets.control_endpoint, self.sockets.view_endpoint
        self.payloads: list[bytes] = []
        self._answers, self._publishes, self._version = answers, publishes, version
        self._clock = MonotonicClock()
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join()
        self.sockets.close()

    def _serve(self) -> None:
        while not self._ends.is_set():
            self.sockets.wait(0.005)
            received = self.sockets.receive()
            now_s = self._clock.now()
            for peer, payload in received if self._answers else ():
                self.payloads.append(payload)
                if self._version == PROTOCOL_VERSION:
                    self.session.receive(peer, payload, now_s)
                else:
                    self.sockets.send(peer, msgpack.packb([self._version, "what nobody here knows"]))
            self.tick(now_s)
            for answer in self.session.take_answers(now_s):
                self.sockets.send(answer.peer, answer.payload)
            if self._publishes:
                self.sockets.publish(b"telemetry", encode(telemetry(self.session.shown_header(now_s))))

    def tick(self, now_s: float) -> None:
        """Do nothing; a test may override this method, which each turn of the thread calls."""
