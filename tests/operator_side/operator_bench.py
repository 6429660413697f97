"""Operator side in virtual time, whose inputs a test gives and whose outputs it reads."""

from typing import Any

from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import LeaseNotice, MotionCommand, MotionState, StiffnessUpdate
from common.protocol.session import SessionState
from operator_side.controller.state import Button, ControllerState
from operator_side.core import OperatorSide
from operator_side.core_settings import CoreSettings
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from tests.helpers.messages import uniform_update


class Bench:
    """Operator side with a simulated controller; the test sends the robot side's messages."""

    def __init__(self, **options: Any) -> None:
        self.side = OperatorSide(2, "clock", CoreSettings(**options))
        self.robot = LinkEnd("robot", 1, "clock")
        self.device = SimulatedDualSense()
        self.now_s = 1.0
        self.side.receive(encode(self.robot.hello(self.now_s)), self.now_s)
        self.notice(SessionState.DISARMED)

    def notice(self, session: SessionState, why: str = "", token: int = 7) -> None:
        notice = LeaseNotice(self.robot.stamp(self.now_s), session=session, why=why, token=token, waiting=2, place=1)
        self.side.receive(encode(notice), self.now_s)

    def stiffness(self, r2: int, state: MotionState = "armed", rumble: float = 0.0) -> bytes:
        return encode(uniform_update(self.robot.stamp(self.now_s), r2=r2, rumble=rumble, state=state))

    def feel(self, r2: int, state: MotionState = "armed", rumble: float = 0.0) -> None:
        """Let the operator side receive a field with the same strengths in all zones."""
        self._take(self.stiffness(r2, state, rumble))

    def feel_field(self, update: StiffnessUpdate) -> None:
        """Let the operator side receive this stiffness message, and write the effects to the controller."""
        self._take(encode(update))

    def _take(self, payload: bytes) -> None:
        self.side.receive(payload, self.now_s)
        self.write()

    def write(self) -> None:
        if (feel := self.side.feel_now(self.now_s)) is not None:
            self.device.write(feel, self.now_s)

    def read(self) -> None:
        state = self.device.read(self.now_s)
        assert state is not None
        self.side.read_state(state, self.now_s)

    def hands(self, *buttons: Button, **state: Any) -> None:
        self.side.read_state(ControllerState(pressed=frozenset(buttons), **state), self.now_s)

    def payloads(self) -> list[bytes]:
        return [message.payload for message in self.side.motion(self.now_s)]

    def commands(self) -> list[MotionCommand]:
        messages = [decode(payload) for payload in self.payloads()]
        return [message for message in messages if isinstance(message, MotionCommand)]
