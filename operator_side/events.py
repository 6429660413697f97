"""What an operator side says of each call, to all who listen: recording, experiments. A listener changes nothing."""

from collections.abc import Sequence
from typing import Literal

from operator_side.controller.feel import Feel
from operator_side.robot_link.commanding import ToRobot

Input = Literal["received", "seen", "state", "tuned", "calibrated", "found", "lost", "stopped"]
"""What comes in: a control payload, a view payload, a controller's state, another P or link, a calibration; that the
controller came or went; a stop that was pressed away from it."""


class Listener:
    """Hears what happens to a core."""

    def on_input(self, what: Input, content: object, now_s: float | None) -> None:
        """Hear of an input, before it is judged. now_s: None for one that has no time."""

    def on_motion(self, messages: Sequence[ToRobot], now_s: float) -> None:
        """Hear what is sent to the robot side."""

    def on_output(self, feel: Feel | None, now_s: float) -> None:
        """Hear what the controller is told; None for nothing."""
