"""From a controller's state to the operator's intent: calibrated travel, sticks without drift, named buttons."""

from dataclasses import dataclass, field, replace
from typing import Final, Literal

from common.episode import EpisodeMark
from operator_side.controller.state import ControllerState, Stick
from operator_side.hands.button_map import MARKS, Action, button_of
from operator_side.hands.travel_calibration import TravelCalibration

_DEFAULT_CALIBRATION: Final = TravelCalibration()


@dataclass(frozen=True)
class OperatorIntent:
    """What the operator's inputs command at one time. Buttons are levels: true while held."""

    l2: float = 0.0
    """Calibrated travel, 0 to 1, of the trigger that moves the gripper back: L2, unless the sides are swapped."""
    r2: float = 0.0
    """Calibrated travel, 0 to 1, of the trigger that moves the gripper forward."""
    lateral: Stick = (0.0, 0.0)
    """Deflection of the stick that moves the gripper across, the left one: right and up positive, length at most 1."""
    turning: Stick = (0.0, 0.0)
    """Deflection of the stick that turns the gripper, the right one, likewise."""
    run: bool = False
    arm: bool = False
    emergency_stop: bool = False
    next_target: bool = False
    """True while the button is held; each change from false to true selects the next target."""
    hand_over: bool = False
    mark: EpisodeMark | None = None
    """Mark of an episode whose button is held; each change to another one but None makes that mark"""
    next_speed: bool = False
    """True while the button is held; each change from false to true selects the next speed scale."""
    next_frame: bool = False
    """Likewise, for the next frame of the sticks."""
    home: float = 0.0
    """Share of full speed at which to go home: 1 while the button is held, else 0."""
    gripper: Literal[-1, 0, 1] = 0
    """-1 opens the gripper, 1 closes it, 0 leaves it, also while both buttons are held."""
    raw: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    """Raw travel of the controller's own L2 and R2, 0 to 1 each, uncalibrated and never swapped."""

    @property
    def triggers_released(self) -> bool:
        """Whether both triggers are within their dead zones, which arming requires."""
        return self.l2 == 0.0 and self.r2 == 0.0

    @property
    def rests(self) -> bool:
        """Whether triggers and sticks are at rest."""
        return self.triggers_released and self.lateral == self.turning == (0.0, 0.0)

    def scaled(self, share: float) -> "OperatorIntent":
        """Return the same intent with triggers and sticks multiplied by `share`."""
        (right, up), (turn_right, turn_up) = self.lateral, self.turning
        sticks = (share * right, share * up), (share * turn_right, share * turn_up)
        return replace(
            self, l2=share * self.l2, r2=share * self.r2, lateral=sticks[0], turning=sticks[1], home=share * self.home
        )

    def resting(self) -> "OperatorIntent":
        """Return the same intent without triggers, sticks, gripper and arming; the other buttons stay."""
        rest = (0.0, 0.0)
        return replace(self, l2=0.0, r2=0.0, lateral=rest, turning=rest, gripper=0, home=0.0, arm=False)


def operator_intent(
    state: ControllerState, calibration: TravelCalibration = _DEFAULT_CALIBRATION, *, swap_sides: bool = False
) -> OperatorIntent:
    """Make the intent from `state` by the calibration and the button map. swap_sides: exchange left and right.

    While the emergency stop is held, every other button counts as not pressed.
    """
    held = {action for action, button in button_of(swap_sides=swap_sides).items() if button in state.pressed}
    if Action.EMERGENCY_STOP in held:
        held = {Action.EMERGENCY_STOP}
    gripper: Literal[-1, 0, 1] = 0
    if (Action.CLOSE_GRIPPER in held) != (Action.OPEN_GRIPPER in held):
        gripper = 1 if Action.CLOSE_GRIPPER in held else -1
    l2, r2 = calibration.l2.travel(state.l2), calibration.r2.travel(state.r2)
    left = calibration.left_stick.deflection(state.left_stick)
    right = calibration.right_stick.deflection(state.right_stick)
    if swap_sides:
        l2, r2, left, right = r2, l2, right, left
    return OperatorIntent(
        l2=l2,
        r2=r2,
        lateral=left,
        turning=right,
        run=Action.RUN in held,
        arm=Action.ARM in held,
        emergency_stop=Action.EMERGENCY_STOP in held,
        next_target=Action.NEXT_TARGET in held,
        hand_over=Action.HAND_OVER in held,
        next_speed=Action.NEXT_SPEED in held,
        next_frame=Action.NEXT_FRAME in held,
        home=float(Action.HOME in held),
        mark=next((mark for action, mark in MARKS.items() if action in held), None),
        gripper=gripper,
        raw=(state.l2, state.r2),
    )
