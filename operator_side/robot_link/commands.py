"""What leaves for the robot side: the owner's commands, else a Hello every so often."""

import math
from typing import Final

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Compensation, MotionCommand
from operator_side.hands.intent import OperatorIntent
from operator_side.robot_link.commanding import HeldCommand, StopButton, ToRobot, motion_command

HEARTBEAT_PERIOD_S: Final = 0.2
"""A Hello this often while nothing else is sent: it opens the session, and then shows that we are alive."""


class Commands:
    """Makes commands of what the hands mean, and remembers which one the robot side holds."""

    def __init__(self, link: LinkEnd, compensation: Compensation, *, full_rate: bool) -> None:
        """full_rate: see HeldCommand."""
        self.sent = 0
        self.stop_button = StopButton()
        self._held = HeldCommand(full_rate=full_rate)
        self._link, self._compensation = link, compensation
        self._hello_s = -math.inf

    def forget(self) -> None:
        """Take it that the robot side holds none of ours."""
        self._held.forget()

    def due(self, intent: OperatorIntent, token: int, now_s: float) -> tuple[ToRobot, MotionCommand] | None:
        """Return the message that has to leave now, and its command; None for what may wait."""
        if (leaving := self._held.due(intent, token, now_s)) is None:
            return None
        command = motion_command(self._link.stamp(now_s), intent, token, self._compensation)
        self.sent += 1
        return leaving._replace(payload=encode(command)), command

    def hello(self, now_s: float) -> list[ToRobot]:
        """Return a Hello if one is due."""
        if now_s - self._hello_s < HEARTBEAT_PERIOD_S:
            return []
        self._hello_s = now_s
        return [ToRobot(encode(self._link.hello(now_s)), everywhere=True)]
