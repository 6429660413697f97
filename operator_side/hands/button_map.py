"""Button map: the one table of buttons and their actions, with which help and docs/controls.md must agree."""

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import Final

from common.episode import EpisodeMark
from operator_side.controller.state import Button


class Action(Enum):
    """Action of a button."""

    RUN = "hold to run"
    ARM = "arm"
    EMERGENCY_STOP = "emergency stop"
    CLOSE_GRIPPER = "close the gripper while held"
    OPEN_GRIPPER = "open the gripper while held"
    NEXT_TARGET = "next target"
    NEXT_SPEED = "speed scale: 100, 50, 25 %"
    NEXT_FRAME = "frame of the sticks: tool, base, camera"
    HOME = "go home while held (triggers and sticks at rest)"
    HAND_OVER = "hand the robot over to the observer that has waited longest"
    START = "episode: start"
    SUCCESS = "episode: success"
    FAILURE = "episode: failure"
    DISCARD = "episode: discard"
    RESET = "put the scene back (disarmed, simulation only)"


BUTTON_OF: Final[Mapping[Action, Button]] = MappingProxyType(
    {
        Action.RUN: Button.L1,
        Action.ARM: Button.OPTIONS,
        Action.EMERGENCY_STOP: Button.CIRCLE,
        Action.CLOSE_GRIPPER: Button.CROSS,
        Action.OPEN_GRIPPER: Button.SQUARE,
        Action.NEXT_TARGET: Button.TRIANGLE,
        Action.NEXT_SPEED: Button.L3,
        Action.NEXT_FRAME: Button.TOUCHPAD,
        Action.HOME: Button.MUTE,
        Action.HAND_OVER: Button.CREATE,
        Action.START: Button.UP,
        Action.SUCCESS: Button.RIGHT,
        Action.FAILURE: Button.LEFT,
        Action.DISCARD: Button.DOWN,
        Action.RESET: Button.R3,
    }
)
"""Button for each action, with the sides not swapped."""
MARKS: Final[Mapping[Action, EpisodeMark]] = MappingProxyType(
    {
        Action.START: "start",
        Action.SUCCESS: "success",
        Action.FAILURE: "failure",
        Action.DISCARD: "discard",
        Action.RESET: "reset",
    }
)
"""Mark of an episode for each action that makes one."""
_SWAPPED_BUTTON_OF: Final[Mapping[Action, Button]] = MappingProxyType({**BUTTON_OF, Action.RUN: Button.R1})


def button_of(*, swap_sides: bool) -> Mapping[Action, Button]:
    """Return the button for each action; swap_sides puts hold-to-run on R1 instead of L1."""
    return _SWAPPED_BUTTON_OF if swap_sides else BUTTON_OF
