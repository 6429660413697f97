"""Events of an operator side, for listeners such as recording and experiments. A listener changes nothing."""

from collections.abc import Sequence
from typing import Literal

from operator_side.controller.feel import Feel
from operator_side.robot_link.commanding import ToRobot

Input = Literal["received", "seen", "state", "tuned", "calibrated", "found", "lost", "stopped"]
"""Inputs: a control payload, a view payload, a controller's state, another P or link, a calibration, the controller
found or lost, a stop pressed away from it."""


class Listener:
    """Receiver of a core's inputs and outputs."""

    def on_input(self, what: Input, content: object, now_s: float | None) -> None:
        """Take an input before validation. now_s: None if it has no time."""

    def on_motion(self, messages: Sequence[ToRobot], now_s: float) -> None:
        """Take the messages to the robot side."""

    def on_output(self, feel: Feel | None, now_s: float) -> None:
        """Take the write to the controller; None for none."""
