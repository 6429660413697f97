"""The newest intent of the hands, until it expires."""

from typing import Final

from operator_side.controller.state import ControllerState
from operator_side.hands.intent import OperatorIntent, operator_intent
from operator_side.hands.travel_calibration import TravelCalibration

INTENT_EXPIRES_S: Final = 0.1
"""Age of the newest state after which nothing is sent, so that the robot stops, in seconds."""


class Hands:
    """The newest intent of the hands."""

    def __init__(self, calibration: TravelCalibration, *, swap_sides: bool) -> None:
        self.calibration = calibration
        self.intent: OperatorIntent | None = None
        """Newest intent; None before the first state, and once the controller is lost"""
        self.lost_s: float | None = None
        """Time at which the controller was lost; None once the arm has stopped since"""
        self._swap_sides = swap_sides
        self._read_s = 0.0

    def read(self, state: ControllerState, now_s: float) -> OperatorIntent:
        """Take one state and return its intent."""
        self.intent = intent = operator_intent(state, self.calibration, swap_sides=self._swap_sides)
        self._read_s = now_s
        return intent

    def lose(self, now_s: float) -> None:
        """Forget the intent: the controller was lost."""
        self.intent, self.lost_s = None, now_s

    def see(self, *, armed: bool, now_s: float) -> None:
        """Note whether the arm has stopped since the controller was lost."""
        if not armed and self.lost_s is not None and now_s > self.lost_s:
            self.lost_s = None

    def present(self, now_s: float) -> OperatorIntent | None:
        """Return the intent unless it has expired."""
        return None if now_s - self._read_s > INTENT_EXPIRES_S else self.intent
