"""What leaves for the robot side: what the hands mean, or a stop that was pressed elsewhere, as commands."""

import math
from operator import attrgetter
from typing import Any, Final, NamedTuple

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Compensation, MotionCommand, MotionState
from common.silence import LONGEST_HELD_S, MOTION_PERIOD_S
from operator_side.hands.intent import OperatorIntent

STOP_HELD_S: Final = 0.2
"""A stop that was pressed away from the controller is held for so long at least."""
HEARTBEAT_PERIOD_S: Final = 0.2
"""A Hello this often while nothing else is sent: it opens the session, and then shows that we are alive."""
_NOTICED: Final = 0.01
"""Of a travel or a stick: the triggers' own noise is less."""
_LATEST_S: Final = LONGEST_HELD_S - MOTION_PERIOD_S / 2.0
"""A command leaves in the turn that is nearest to `LONGEST_HELD_S`, however early or late that turn comes."""
STOPPING: Final = OperatorIntent(emergency_stop=True)
"""What the hands mean while it is held, whatever they do."""

_BUTTONS: Final = ("run", "arm", "emergency_stop", "next_target", "hand_over")
_NAMES: Final = ("l2", "r2", "lateral", "turning", *_BUTTONS)
_PRESSED: Final[Any] = attrgetter(*_BUTTONS)
_MEANT: Final[Any] = attrgetter(*_NAMES)


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
        pressed = (*_PRESSED(intent), intent.gripper, token)
        moved = (intent.l2, intent.r2, *intent.lateral, *intent.turning)
        changed, rests = pressed != self._pressed, moved != self._moved and not any(moved)
        at_once = self._full_rate or changed or rests or now_s - self._sent_s > _LATEST_S
        if not at_once and all(abs(now - held) <= _NOTICED for now, held in zip(moved, self._moved, strict=True)):
            return None
        self._pressed, self._moved, self._sent_s = pressed, moved, now_s
        return ToRobot(b"", everywhere=changed or rests or intent.emergency_stop)


class Commands:
    """Makes commands of what the hands mean, else a Hello every so often."""

    def __init__(self, link: LinkEnd, compensation: Compensation, *, full_rate: bool) -> None:
        """full_rate: see HeldCommand."""
        self.sent = 0
        self.stop_button = StopButton()
        self.held = HeldCommand(full_rate=full_rate)
        self._link, self._compensation = link, compensation
        self._hello_s = -math.inf

    def due(self, intent: OperatorIntent, token: int, now_s: float) -> tuple[ToRobot, MotionCommand] | None:
        """Return the message that has to leave now, and its command; None for what may wait."""
        if (leaving := self.held.due(intent, token, now_s)) is None:
            return None
        meant = dict(zip(_NAMES, _MEANT(intent), strict=True)) | {"gripper": float(intent.gripper), "token": token}
        command = MotionCommand(self._link.stamp(now_s), compensation=self._compensation, **meant)
        self.sent += 1
        return leaving._replace(payload=encode(command)), command

    def hello(self, now_s: float) -> list[ToRobot]:
        """Return a Hello if one is due."""
        if now_s - self._hello_s < HEARTBEAT_PERIOD_S:
            return []
        self._hello_s = now_s
        return [ToRobot(encode(self._link.hello(now_s)), everywhere=True)]
