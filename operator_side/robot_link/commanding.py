"""What the hands mean, or a stop that was pressed elsewhere, as the command that goes to the robot side."""

import math
from typing import Final, NamedTuple

from common.protocol.messages import Compensation, Header, MotionCommand, MotionState
from common.silence import LONGEST_HELD_S, MOTION_PERIOD_S
from operator_side.hands.intent import OperatorIntent

STOP_HELD_S: Final = 0.2
"""A stop that was pressed away from the controller is held for so long at least."""
_NOTICED: Final = 0.01
"""Of a travel or a stick: the triggers' own noise is less."""
_LATEST_S: Final = LONGEST_HELD_S - MOTION_PERIOD_S / 2.0
"""A command leaves in the turn that is nearest to `LONGEST_HELD_S`, however early or late that turn comes."""
STOPPING: Final = OperatorIntent(emergency_stop=True)
"""What the hands mean while it is held, whatever they do."""


class ToRobot(NamedTuple):
    """One payload for the robot side."""

    payload: bytes
    everywhere: bool = False
    """Over every connection, as something that must arrive soon; else over the next in turn."""


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


class HeldCommand:
    """The command that the robot side holds until the next one (zero-order hold), and when that has to leave.

    A change of travel that no finger does on purpose may wait for the next one, for 16 ms at most.
    """

    def __init__(self, *, full_rate: bool = False) -> None:
        """full_rate: every command leaves."""
        self._full_rate = full_rate
        self.forget()

    def forget(self) -> None:
        """The robot side holds none of ours: the next one leaves at once."""
        self._pressed: tuple[float, ...] = ()
        self._moved: tuple[float, ...] = ()
        self._sent_s = -math.inf

    def due(self, intent: OperatorIntent, token: int, now_s: float) -> ToRobot | None:
        """None for what may wait; else where to send it, still without a payload.

        At once: a button, another token, a travel or stick by more than 0.01, and rest, which is never approximated.
        """
        pressed = (
            *(intent.run, intent.arm, intent.emergency_stop, intent.next_target, intent.hand_over),
            *(intent.gripper, token),
        )
        moved = (intent.l2, intent.r2, *intent.lateral, *intent.turning)
        changed = pressed != self._pressed
        if not (self._full_rate or changed or self._differs(moved) or now_s - self._sent_s > _LATEST_S):
            return None
        rests = moved != self._moved and not any(moved)
        self._pressed, self._moved, self._sent_s = pressed, moved, now_s
        return ToRobot(b"", everywhere=changed or rests or intent.emergency_stop)

    def _differs(self, moved: tuple[float, ...]) -> bool:
        if moved != self._moved and not any(moved):
            return True
        return any(abs(now - held) > _NOTICED for now, held in zip(moved, self._moved, strict=True))


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
