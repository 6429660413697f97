"""What each part of the controller is for: the one table that reading, help and docs/controls.md follow."""

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import Final

from operator_side.dualsense.reports.controller_state import Button


class Action(Enum):
    """What a button is for."""

    RUN = "hold to run"
    ARM = "arm"
    EMERGENCY_STOP = "emergency stop"
    CLOSE_GRIPPER = "close the gripper while held"
    OPEN_GRIPPER = "open the gripper while held"
    NEXT_TARGET = "next target"
    HAND_OVER = "hand the robot over to the observer that has waited longest"


class Motion(Enum):
    """What a trigger or a stick is for."""

    ADVANCE = "advance along the tool"
    RETREAT = "retreat along the tool"
    ACROSS = "move across"
    TURN = "turn the tool"


class Control(Enum):
    """A part of the controller that is moved farther or less far."""

    L2 = "L2"
    R2 = "R2"
    LEFT_STICK = "left stick"
    RIGHT_STICK = "right stick"


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
"""The whole button map."""
CONTROL_OF: Final[Mapping[Motion, Control]] = MappingProxyType(
    {
        Motion.ADVANCE: Control.R2,
        Motion.RETREAT: Control.L2,
        Motion.ACROSS: Control.LEFT_STICK,
        Motion.TURN: Control.RIGHT_STICK,
    }
)
"""And what the triggers and sticks do."""

_OTHER_BUTTON: Final = {Button.L1: Button.R1, Button.R1: Button.L1}
_OTHER_CONTROL: Final = {
    Control.L2: Control.R2,
    Control.R2: Control.L2,
    Control.LEFT_STICK: Control.RIGHT_STICK,
    Control.RIGHT_STICK: Control.LEFT_STICK,
}


def _mirrored_buttons() -> Mapping[Action, Button]:
    return MappingProxyType({action: _OTHER_BUTTON.get(button, button) for action, button in BUTTON_OF.items()})


_SWAPPED_BUTTON_OF: Final = _mirrored_buttons()


def button_of(*, swap_sides: bool) -> Mapping[Action, Button]:
    """`BUTTON_OF`, or, with left and right swapped, the same with R1 for L1."""
    return _SWAPPED_BUTTON_OF if swap_sides else BUTTON_OF


def control_table() -> list[tuple[str, str, str]]:
    """Rows for people: what it does, what does it, and what does it with left and right swapped."""
    motions = [(motion.value, control.value, _OTHER_CONTROL[control].value) for motion, control in CONTROL_OF.items()]
    actions = [(action.value, button.value, _SWAPPED_BUTTON_OF[action].value) for action, button in BUTTON_OF.items()]
    return motions + actions
