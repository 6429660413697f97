"""What the hands mean, or a stop that was pressed elsewhere, as the command that goes to the robot side."""

import math
from typing import Final

from common.protocol.messages import Compensation, Header, MotionCommand, MotionState
from operator_side.hands.intent import OperatorIntent

STOP_HELD_S: Final = 0.2
"""A stop that was pressed away from the controller is held for so long at least."""
STOPPING: Final = OperatorIntent(
    l2=0.0,
    r2=0.0,
    lateral=(0.0, 0.0),
    turning=(0.0, 0.0),
    run=False,
    arm=False,
    emergency_stop=True,
    next_target=False,
    hand_over=False,
    gripper=0,
)
"""What the hands mean while it is held, whatever they do."""


class StopButton:
    """An emergency stop besides the controller's: held for a while, and until the robot side says that it stands."""

    def __init__(self) -> None:
        self.presses = 0
        self._pressed_s = -math.inf
        self._holds = False

    def press(self, now_s: float) -> None:
        """It is pressed, or still is."""
        self.presses += not self._holds
        self._pressed_s, self._holds = now_s, True

    def holds(self, now_s: float, state: MotionState | None) -> bool:
        """Whether it counts as held at `now_s`; `state`: the robot's as last heard, None for unknown."""
        if self._holds and now_s - self._pressed_s >= STOP_HELD_S and state == "stopped":
            self._holds = False
        return self._holds

    def forget(self) -> None:
        """Another operator owns the robot: it stops it, not we."""
        self._holds = False


def motion_command(header: Header, intent: OperatorIntent, token: int, compensation: Compensation) -> MotionCommand:
    """`intent` under the lease of `token`."""
    return MotionCommand(
        header,
        l2=intent.l2,
        r2=intent.r2,
        lateral=intent.lateral,
        turning=intent.turning,
        gripper=float(intent.gripper),
        run=intent.run,
        arm=intent.arm,
        emergency_stop=intent.emergency_stop,
        next_target=intent.next_target,
        hand_over=intent.hand_over,
        token=token,
        compensation=compensation,
    )
