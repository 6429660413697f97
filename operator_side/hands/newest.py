"""Newest intent of the operator, until it expires."""

from dataclasses import replace
from typing import Final

from operator_side.controller.state import ControllerState
from operator_side.hands.choices import Choices
from operator_side.hands.intent import OperatorIntent, operator_intent
from operator_side.hands.travel_calibration import TravelCalibration

INTENT_EXPIRES_S: Final = 0.1
"""Age of the controller's newest state, in seconds, after which no command is sent, so that the arm stops"""


class NewestIntent:
    """Newest intent of the operator, from a controller's states."""

    def __init__(
        self, calibration: TravelCalibration, choices: Choices, *, swap_sides: bool, fixed_task: bool = False
    ) -> None:
        """fixed_task: whether no other target can be chosen."""
        self.calibration, self.choices = calibration, choices
        self.intent: OperatorIntent | None = None
        """Newest intent; None before the first state, and once the controller is lost"""
        self.lost_s: float | None = None
        """Time at which the controller was lost; None before a loss, and once the arm has stopped after it"""
        self._swap_sides, self._fixed_task = swap_sides, fixed_task
        self._read_s = 0.0

    def read(self, state: ControllerState, now_s: float) -> OperatorIntent:
        """Take a controller's state and return the intent made from it."""
        intent = operator_intent(state, self.calibration, swap_sides=self._swap_sides)
        if self._fixed_task and intent.next_target:
            intent = replace(intent, next_target=False)
        self.intent = intent
        self._read_s = now_s
        self.choices.read(intent)
        return intent

    def lose(self, now_s: float) -> None:
        """Forget the intent, as the controller was lost."""
        self.intent, self.lost_s = None, now_s

    def see(self, *, armed: bool, now_s: float) -> None:
        """Take a report whether the arm is armed; if not, the arm has stopped since the controller was lost."""
        if not armed and self.lost_s is not None and now_s > self.lost_s:
            self.lost_s = None

    def present(self, now_s: float) -> OperatorIntent | None:
        """Return the intent; None if it has expired or there is none."""
        return None if now_s - self._read_s > INTENT_EXPIRES_S else self.intent
