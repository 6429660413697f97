"""View of a run for people: the statuses of one side or both, and the state in words.

`live_line` writes it for a terminal, `live_story` for a file. Distances are perceived, never the simulation's truth.
"""

from typing import NamedTuple

from common.command.words import phase_words, printable
from common.status.phase import phase_of
from common.status.statuses import OperatorStatus, RobotStatus

_LARGEST = 1e300
SLOW = 0.9
"""Share of real time below which a simulation is called slow."""


class TriggerView(NamedTuple):
    """Trigger of the controller; None is unknown."""

    name: str
    pulled: float | None
    """Calibrated travel, 0 to 1."""
    resists: float | None
    """Stiffness, 0 to 1; 0 while the arm is not armed, because the trigger is free then."""


class LiveView:
    """View of one moment; the fields of a missing status are unknown."""

    def __init__(self, robot: RobotStatus | None = None, operator: OperatorStatus | None = None) -> None:
        facts, first = phase_of(robot, operator), operator or robot
        self.look, self.alarm = facts.look, facts.alarm
        self.phase, self.reason = phase_words(facts, first)
        self.robot, self.operator = robot or RobotStatus(), operator or OperatorStatus()
        self.side, self.scene = first or self.operator, robot or self.operator
        """Better source: `side` for controller and link, `scene` for the objects ahead and in the hand."""
        side, free = self.side, self.side.state not in (None, "armed")
        self.armed = side.state == "armed"
        self.triggers = (
            TriggerView("L2", number(side.l2_pulled), 0.0 if free else number(side.l2)),
            TriggerView("R2", number(side.r2_pulled), 0.0 if free else number(side.r2)),
        )
        held = self.scene.holding
        self.holding = printable(held) if isinstance(held, str) else "something" if held else None
        """Object between the fingers."""
        self.stands = ", it stands" if self.scene.stands else ""


def number(value: float | None) -> float | None:
    """Return a finite number unchanged; None for all else."""
    return value if value is not None and -_LARGEST < value < _LARGEST else None
