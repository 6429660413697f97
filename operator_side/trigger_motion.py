"""The controller's state to what the operator means: calibrated travel, sticks without drift, named buttons."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import Final, Literal

from operator_side.dualsense.controller_state import Button, ControllerState, Stick
from operator_side.travel_calibration import TravelCalibration


class Action(Enum):
    """What a button is for."""

    RUN = "hold to run"
    ARM = "arm"
    EMERGENCY_STOP = "emergency stop"
    CLOSE_GRIPPER = "close the gripper while held"
    OPEN_GRIPPER = "open the gripper while held"
    NEXT_TARGET = "next target"
    HAND_OVER = "hand the robot over to the observer that has waited longest"


BUTTON_OF: Final[Mapping[Action, Button]] = MappingProxyType(
    {
        Action.RUN: Button.L1,
        Action.ARM: Button.OPTIONS,
        Action.EMERGENCY_STOP: Button.CIRCLE,
        Action.CLOSE_GRIPPER: Button.CROSS,
        Action.OPEN_GRIPPER: Button.SQUARE,
        Action.NEXT_TARGET: Button.TRIANGLE,
        Action.HAND_OVER: Button.CREATE,
    }
)
"""The whole button map. Besides: R2 advances, L2 retreats, the left stick moves across, the right one turns."""


_DEFAULT_CALIBRATION: Final = TravelCalibration()


@dataclass(frozen=True)
class OperatorIntent:
    """What the operator's hands mean at one moment. Buttons are levels: they are true as long as they are held."""

    l2: float
    """Calibrated travel, 0 to 1: retreat."""
    r2: float
    """Calibrated travel, 0 to 1: advance."""
    lateral: Stick
    """Left stick, right and up positive, within the unit circle."""
    turning: Stick
    """Right stick, right and up positive, within the unit circle."""
    run: bool
    arm: bool
    emergency_stop: bool
    next_target: bool
    """One press is one step: whoever counts looks for the change from false to true."""
    hand_over: bool
    gripper: Literal[-1, 0, 1]
    """-1 opens, 1 closes, 0 holds; both buttons at once hold."""

    @property
    def triggers_released(self) -> bool:
        """Both triggers are within their dead zones, as arming needs them."""
        return self.l2 == 0.0 and self.r2 == 0.0


def operator_intent(state: ControllerState, calibration: TravelCalibration = _DEFAULT_CALIBRATION) -> OperatorIntent:
    """Read `state` through the calibration and the button map.

    While the emergency stop is held, every other button counts as not pressed.
    """
    held = {action for action, button in BUTTON_OF.items() if button in state.pressed}
    if Action.EMERGENCY_STOP in held:
        held = {Action.EMERGENCY_STOP}
    gripper: Literal[-1, 0, 1] = 0
    if (Action.CLOSE_GRIPPER in held) != (Action.OPEN_GRIPPER in held):
        gripper = 1 if Action.CLOSE_GRIPPER in held else -1
    return OperatorIntent(
        l2=calibration.l2.travel(state.l2),
        r2=calibration.r2.travel(state.r2),
        lateral=calibration.left_stick.deflection(state.left_stick),
        turning=calibration.right_stick.deflection(state.right_stick),
        run=Action.RUN in held,
        arm=Action.ARM in held,
        emergency_stop=Action.EMERGENCY_STOP in held,
        next_target=Action.NEXT_TARGET in held,
        hand_over=Action.HAND_OVER in held,
        gripper=gripper,
    )
