"""Robot side without an arm: with real sockets, lease and safety, and a stiffness that the test sets."""

from common.protocol.codec import encode
from common.protocol.uniform_field import STRENGTHS
from robot_side.operators.safety import SafetySettings
from tests.helpers.messages import uniform_update
from tests.helpers.serving_robot import ServingRobot

SLOW_MACHINE = SafetySettings(gap_s=3.0, age_s=10.0, max_delay_s=20.0, healthy_s=0.3, lease_s=30.0)
"""Longer safety limits, as an emulated processor is too slow for the usual 0.1 s. Tests do not check reaction times."""
_FIELD_PERIOD_S = 0.02


class ArmlessRobot(ServingRobot):
    """Robot side without an arm, which runs in a thread during the context."""

    def __init__(self) -> None:
        super().__init__(publishes=False, safety=SLOW_MACHINE)
        self.r2_stiffness = 0.0
        """Stiffness of R2 in each zone, 0 to 1"""
        self.moving = False
        """Whether the robot side would now command an arm to advance"""
        self.state = "disarmed"
        self._next_s = 0.0

    @property
    def flags(self) -> list[str]:
        """Flags of an operator side that connect it to this robot side."""
        return [f"--connect={self.control}", f"--view-connect={self.view}"]

    @property
    def commands(self) -> int:
        """Number of motion commands received."""
        return self.session.motion_received

    def tick(self, now_s: float) -> None:
        """Update session and safety as a robot side does, and send the owner of the lease a stiffness."""
        self.session.update(now_s)
        permission = self.session.permission(now_s)
        self.state = permission.state
        self.moving = permission.command is not None and permission.command.r2 > 0.0
        if now_s < self._next_s or not (owners := self.session.owners(now_s)):
            return
        [owner] = owners
        self._next_s = now_s + _FIELD_PERIOD_S
        stiffness = uniform_update(owner.header, r2=round(STRENGTHS * self.r2_stiffness), state=permission.state)
        self.sockets.send(owner.peer, encode(stiffness), everywhere=owner.everywhere)
