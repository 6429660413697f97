"""Messages to the robot side: commands, made from the operator's intent or an emergency stop, and Hellos."""

import math
from operator import attrgetter
from typing import Any, Final, NamedTuple

from common.periods import EARLY, TURN_S
from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Compensation, MotionCommand, MotionState
from common.silence import LONGEST_HELD_S
from operator_side.hands.intent import OperatorIntent

STOP_HELD_S: Final = 0.2
"""Minimum time, in seconds, for which a stop pressed elsewhere than on the controller is held"""
HEARTBEAT_PERIOD_S: Final = 0.2
"""Seconds between Hellos while no command is sent. The first opens the session; later ones keep it open."""
_NOTICED: Final = 0.01
"""Maximum change of a travel or a deflection that need not be sent at once; sensor noise is below it"""
STOPPING: Final = OperatorIntent(emergency_stop=True)
"""Intent while a stop is held, whatever the controller's inputs are"""

_BUTTONS: Final = ("run", "arm", "emergency_stop", "next_target", "home", "hand_over")
_NAMES: Final = ("l2", "r2", "lateral", "turning", *_BUTTONS)
_PRESSED: Final[Any] = attrgetter(*_BUTTONS)
_MEANT: Final[Any] = attrgetter(*_NAMES)


class ToRobot(NamedTuple):
    """One payload for the robot side."""

    payload: bytes
    everywhere: bool = False
    """Whether to send over every connection, because the message is urgent; otherwise over the next one in turn"""


class StopButton:
    """Emergency stop pressed elsewhere than on the controller.

    It counts as held for at least STOP_HELD_S, and until the robot side reports `stopped`.
    """

    def __init__(self) -> None:
        self.presses = 0
        self._pressed_s = -math.inf
        self._holds = False

    def press(self, now_s: float) -> None:
        """Note that the stop is pressed, or still held."""
        self.presses += not self._holds
        self._pressed_s, self._holds = now_s, True

    def holds(self, now_s: float, state: MotionState | None) -> bool:
        """Return whether the stop counts as held at `now_s`. state: newest state of the arm; None if unknown."""
        if self._holds and now_s - self._pressed_s >= STOP_HELD_S and state == "stopped":
            self._holds = False
        return self._holds

    def forget(self) -> None:
        """Release the stop, as another operator has the lease now and must stop the arm themselves."""
        self._holds = False


class HeldCommand:
    """Last command sent, which the robot side holds until the next one (zero-order hold); decides when the next is due.

    A change of travel or deflection of at most 0.01 is sent with the next command, at most 16 ms later. In turns
    shorter than 4 ms a larger one waits until 4 ms after the last command.
    """

    def __init__(self, *, full_rate: bool = False) -> None:
        """full_rate: send a command in every turn of the loop."""
        self._full_rate = full_rate
        self.forget()

    def forget(self) -> None:
        """Note that the robot side holds no command of ours, so that the next one is sent at once."""
        self._pressed: tuple[float, ...] = ()
        self._moved: tuple[float, ...] = ()
        self._sent_s = self._turned_s = -math.inf

    def due(self, intent: OperatorIntent, token: int, now_s: float) -> ToRobot | None:
        """Return a message without payload, for the caller to fill; None if the command may wait.

        A command is due at once if a button or the lease's token has changed, or if all have come to rest; if a travel
        or deflection has changed by more than 0.01; else in the last turn that is not too late for LONGEST_HELD_S.
        """
        turn_s, self._turned_s = now_s - self._turned_s, now_s
        pressed = (*_PRESSED(intent), intent.gripper, token)
        moved = (intent.l2, intent.r2, *intent.lateral, *intent.turning)
        changed, rests = pressed != self._pressed, moved != self._moved and not any(moved)
        waits = now_s - self._sent_s + EARLY * turn_s < LONGEST_HELD_S
        at_once = self._full_rate or changed or rests or not waits
        early = now_s - self._sent_s + (1.0 - EARLY) * turn_s < TURN_S
        if not at_once and (early or all(abs(a - b) <= _NOTICED for a, b in zip(moved, self._moved, strict=True))):
            return None
        self._pressed, self._moved, self._sent_s = pressed, moved, now_s
        return ToRobot(b"", everywhere=changed or rests or intent.emergency_stop)


class Commands:
    """Makes the messages to the robot side: commands from the intent, and Hellos while there are none."""

    def __init__(self, link: LinkEnd, compensation: Compensation, *, full_rate: bool) -> None:
        """full_rate: send a command in every turn of the loop."""
        self.sent = self.turns = 0
        """Number of commands sent, and of turns in which one could have been"""
        self.stop_button = StopButton()
        self.held = HeldCommand(full_rate=full_rate)
        self._link, self._compensation = link, compensation
        self._hello_s = -math.inf

    def due(self, intent: OperatorIntent, token: int, now_s: float) -> tuple[ToRobot, MotionCommand] | None:
        """Return the message to send now, and the command in it; None if the command may wait."""
        self.turns += 1
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
