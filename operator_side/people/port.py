"""Port of a person who acts at the controller: what they see and feel in, forces and sticks out."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

from common.protocol.messages import Telemetry, Vector2
from operator_side.controller.state import Button

_STICK_AXES: Final = ("right", "up")


@dataclass(frozen=True)
class FingerInput:
    """Forces on the triggers, in newtons, and raw positions of the sticks, -1 to 1, at one time."""

    r2_n: float = 0.0
    l2_n: float = 0.0
    left_stick: Vector2 = (0.0, 0.0)
    right_stick: Vector2 = (0.0, 0.0)
    buttons: frozenset[Button] = frozenset()
    """Buttons that are held besides hold-to-run"""

    def __post_init__(self) -> None:
        """Raise ValueError for a force or a stick out of range."""
        for name in ("r2_n", "l2_n"):
            force_n = getattr(self, name)
            if not (isinstance(force_n, int | float) and 0.0 <= force_n < math.inf):
                raise ValueError(f"{name} = {force_n!r}; valid: a force of 0 N or more")
        for name in ("left_stick", "right_stick"):
            stick = getattr(self, name)
            if len(stick) != len(_STICK_AXES) or not all(-1.0 <= part <= 1.0 for part in stick):
                raise ValueError(f"{name} = {stick}; valid: right and up, -1 to 1 each")
        if not all(isinstance(button, Button) for button in self.buttons):
            raise ValueError(f"buttons = {self.buttons}; valid: a set of Button")


@dataclass(frozen=True)
class Seen:
    """What a person sees and feels at one time, after the link's delay."""

    since_s: float
    """Time since the arm was armed and the person began to act"""
    screen: Telemetry
    """Newest telemetry: state, tool, target, opening of the gripper, speed"""
    travel: Vector2
    """Mechanical travel of L2 and R2, 0 to 1"""
    strengths: tuple[int, int]
    """Strengths, 0 to 8, of the zones that L2 and R2 have reached"""
    rumble: float
    """Drive of the left motor, 0 to 1"""
    round_trip_s: float
    """Mean round trip, which a person knows after a while"""


@runtime_checkable
class Person(Protocol):
    """Somebody at the controller, who acts while the arm is armed."""

    def act(self, seen: Seen) -> FingerInput | None:
        """Return what the hands do from now on; None: the person has finished, and lets go."""
        ...


Pull = Callable[[float], FingerInput]
"""Function that returns the input at a time, in seconds since the pull began"""


@dataclass(frozen=True)
class Pulling:
    """Person who pulls as a function of time says, whatever is seen and felt."""

    pull: Pull

    def act(self, seen: Seen) -> FingerInput:
        """Return the input of the present time."""
        return self.pull(seen.since_s)
