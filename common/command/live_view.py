"""State of a run as people read it: the statuses of one side or both, and the phase in words.

`live_line` writes it for a terminal, `live_story` for a file. Distances are perceived, never the simulation's truth.
"""

from typing import NamedTuple

from common.command.words import phase_words
from common.status.phase import phase_of
from common.status.statuses import OperatorStatus, RobotStatus

_LARGEST = 1e300
_STRONGEST = 8
UNNAMED = "an object"
SLOW = 0.9
"""Speed of the simulation, as a share of real time, below which the live line shows it."""


class TriggerView(NamedTuple):
    """State of one trigger of the controller; None is unknown."""

    name: str
    pulled: float | None
    """Calibrated travel, 0 to 1."""
    resists: float | None
    """Share of the strongest effect that the finger meets now, 0 to 1. Where nothing can be met (no haptics) or it is
    unknown (a robot side alone): stiffness to which the present course leads. 0 while the arm is not armed"""


class LiveView:
    """State of a run at one time, for people; if a side's status is missing, its fields are unknown."""

    def __init__(self, robot: RobotStatus | None = None, operator: OperatorStatus | None = None) -> None:
        facts, first = phase_of(robot, operator), operator or robot
        self.border, self.alarm = facts.border, facts.alarm
        self.phase, self.reason = phase_words(facts, first)
        self.robot, self.operator = robot or RobotStatus(), operator or OperatorStatus()
        self.side, self.scene = first or self.operator, robot or self.operator
        """`side`: for controller and link; the operator side's status, or the robot side's if there is no other.
        `scene`: for objects; the robot side's status, or the operator side's if there is no other."""
        side, hands = self.side, self.operator
        self.armed = side.state == "armed"
        self.triggers = (
            TriggerView("L2", number(side.l2_pulled), self._resists(hands.l2_meets, side.l2_course_stiffness)),
            TriggerView("R2", number(side.r2_pulled), self._resists(hands.r2_meets, side.r2_course_stiffness)),
        )
        held = self.scene.holding
        self.holding = held if isinstance(held, str) else UNNAMED if held else None
        """Name of the object between the fingers, UNNAMED if the name is unknown, None for no object."""
        self.hindrance = self.scene.hindrance
        """Cause for which the arm does not follow the command, in words; None if it follows"""
        self.stands = ", it stands" if self.scene.stands else ""

    def _resists(self, meets: int | None, course_stiffness: float | None) -> float | None:
        if self.side.state not in (None, "armed"):
            return 0.0
        return number(course_stiffness) if meets is None or not self.operator.haptics else meets / _STRONGEST


def number(value: float | None) -> float | None:
    """Return `value` if it is a finite number, else None."""
    return value if value is not None and -_LARGEST < value < _LARGEST else None
