"""Events of the operator side's core, for listeners such as recordings and experiments, which only observe."""

from collections.abc import Sequence
from typing import Literal

from operator_side.controller.feel import Feel
from operator_side.robot_link.commanding import ToRobot

Input = Literal["received", "seen", "state", "tuned", "calibrated", "found", "lost", "stopped", "marked", "episode"]
"""Kind of an input, in the order above: a control payload; a view payload; a controller's state; a tuning request; a
calibration; a controller found; a controller lost; an emergency stop pressed elsewhere than on the controller; a mark
of an episode made elsewhere than there; a mark that counts, which follows from the others."""


class Listener:
    """Receiver of a core's inputs and outputs."""

    def on_input(self, what: Input, content: object, now_s: float | None) -> None:
        """Take an input, before the core checks it. now_s: None for a calibration, which has no time."""

    def on_motion(self, messages: Sequence[ToRobot], now_s: float) -> None:
        """Take the messages to the robot side of one turn."""

    def on_output(self, feel: Feel | None, now_s: float) -> None:
        """Take the effects to write to the controller; None if nothing is to be written."""
