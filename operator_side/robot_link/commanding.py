"""Messages to the robot side: the hands' intent, or a stop pressed elsewhere, as commands."""

import math
from operator import attrgetter
from typing import Any, Final, NamedTuple

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Compensation, MotionCommand, MotionState
from common.silence import LONGEST_HELD_S, MOTION_PERIOD_S
from operator_side.hands.intent import OperatorIntent

STOP_HELD_S: Final = 0.2
"""Least duration of a stop that was pressed away from the controller, in seconds."""
HEARTBEAT_PERIOD_S: Final = 0.2
"""Period of Hellos while nothing else is sent: the first opens the session, later ones show that we are alive."""
_NOTICED: Final = 0.01
"""Largest change of a travel or a stick that may wait; the triggers' own noise is less."""
_LATEST_S: Final = LONGEST_HELD_S - MOTION_PERIOD_S / 2.0
"""Time after which a command is sent: in the turn nearest to `LONGEST_HELD_S`, early or late."""
STOPPING: Final = OperatorIntent(emergency_stop=True)
"""Intent while the stop is held, whatever the hands do."""

_BUTTONS: Final = ("run", "arm", "emergency_stop", "next_target", "hand_over")
_NAMES: Final = ("l2", "r2", "lateral", "turning", *_BUTTONS)
_PRESSED: Final[Any] = attrgetter(*_BUTTONS)
_MEANT: Final[Any] = attrgetter(*_NAMES)


class ToRobot(NamedTuple):
    """One payload for the robot side."""

    payload: bytes
    everywhere: bool = False
    """Send over every connection, as it must arrive soon; else over the next in turn."""


class StopButton:
    """Emergency stop besides the controller's: held for a while, and until the robot side reports `stopped`."""

    def __init__(self) -> None:
        self.presses = 0
        self._pressed_s = -math.inf
        self._holds = False

    def press(self, now_s: float) -> None:
        """Note that it is pressed, or still is."""
        self.presses += not self._holds
        self._pressed_s, self._holds = now_s, True

    def holds(self, now_s: float, state: MotionState | None) -> bool:
        """Return whether it counts as held at `now_s`. state: the robot's newest known one, None for unknown."""
        if self._holds and now_s - self._pressed_s >= STOP_HELD_S and state == "stopped":
            self._holds = False
        return self._holds

    def forget(self) -> None:
        """Release it: another operator owns the robot, and the stop is theirs."""
        self._holds = False


class HeldCommand:
    """Command that the robot side holds until the next one (zero-order hold), and the time at which that is due.

    A change of travel that no finger makes on purpose may wait for the next command, 16 ms at most.
    """

    def __init__(self, *, full_rate: bool = False) -> None:
        """full_rate: send every command."""
        self._full_rate = full_rate
        self.forget()

    def forget(self) -> None:
        """Note that the robot side holds no command of ours: send the next one at once."""
        self._pressed: tuple[float, ...] = ()
        self._moved: tuple[float, ...] = ()
        self._sent_s = -math.inf

    def due(self, intent: OperatorIntent, token: int, now_s: float) -> ToRobot | None:
        """Return the message, still without payload; None if the command may wait.

        Due at once: a button, another token, a travel or stick by more than 0.01, and rest, which is sent exactly.
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
    """Source of commands from the intent, else of a Hello each period."""

    def __init__(self, link: LinkEnd, compensation: Compensation, *, full_rate: bool) -> None:
        """full_rate: as HeldCommand's."""
        self.sent = 0
        self.stop_button = StopButton()
        self.held = HeldCommand(full_rate=full_rate)
        self._link, self._compensation = link, compensation
        self._hello_s = -math.inf

    def due(self, intent: OperatorIntent, token: int, now_s: float) -> tuple[ToRobot, MotionCommand] | None:
        """Return the message to send now, and its command; None if it may wait."""
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
