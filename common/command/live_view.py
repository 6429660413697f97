"""A run as people see it: figures that each may be unknown, and the state in words.

The statuses of one side or both become one frozen record here, which `live_line` writes for a terminal and
`live_story` for a file. All distances are perceived ones, never the simulation's truth.
"""

from dataclasses import dataclass

from msgspec import UNSET

from common.command.words import phase_words, printable
from common.status.codes import LinkState
from common.status.phase import phase_of
from common.status.statuses import OperatorStatus, RobotStatus

_LARGEST = 1e300
SLOW = 0.9
"""A simulation below this share of real time is said to be slow."""


@dataclass(frozen=True)
class TriggerView:
    """One trigger of the controller; None is not known."""

    pulled: float | None = None
    """Calibrated travel, 0 to 1."""
    resists: float | None = None
    """Stiffness, 0 to 1; 0 while the arm is not armed, as the trigger is free then."""


@dataclass(frozen=True)
class LiveView:
    """Everything that is shown; None is not known."""

    phase: str = "starting"
    """The state, in a word or two."""
    reason: str | None = None
    """Why, after a stop or a lost link."""
    alarm: bool = False
    """Whether that has stopped the arm against somebody's will."""
    state: str | None = None
    """The arm's; None while the robot side has not said."""
    armed: bool = False
    linked: bool | None = None
    real_time: float | None = None
    """The simulation's share of it."""
    delay_ms: float | None = None
    queue_ms: float | None = None
    """The queue that the robot side's own messages make in the link."""
    lost_percent: float | None = None
    """Packets that were lost on the way to the operator."""
    l2: TriggerView = TriggerView()
    r2: TriggerView = TriggerView()
    haptics: bool = True
    """Whether the triggers are stiffened at all; else `resists` only says how near danger is."""
    nearest: str | None = None
    """The nearest object's name, supports aside."""
    nearest_mm: float | None = None
    """From the gripper's surface to it, as perceived."""
    has_target: bool | None = None
    target_mm: float | None = None
    """From the gripper's surface to the target's, as perceived."""
    target_centre_mm: float | None = None
    """From the point between the fingertips to the target's centre, as perceived."""
    holding: str | None = None
    """The object between the fingers."""
    stands: bool = False
    """Whether that stands on something."""


def live_view(robot: RobotStatus | None = None, operator: OperatorStatus | None = None) -> LiveView:
    """The record of what is known of either side: of controller and link what the operator side says first."""
    facts, side, scene = phase_of(robot, operator), operator or robot, robot or operator
    if side is None or scene is None:
        return LiveView()
    phase, reason = phase_words(facts, side)
    free = 0.0 if side.state not in (None, "armed") else None
    holding = scene.holding if isinstance(scene, RobotStatus) else "something" if scene.holding else None
    return LiveView(
        phase=phase,
        reason=reason,
        alarm=facts.alarm,
        state=side.state,
        armed=side.state == "armed",
        linked=side.link is LinkState.UP,
        real_time=None if robot is None else number(robot.real_time),
        delay_ms=number(side.delay_ms),
        queue_ms=number(scene.queue_ms),
        lost_percent=number(scene.lost_percent),
        l2=TriggerView(number(side.l2_pulled), number(side.l2) if free is None else free),
        r2=TriggerView(number(side.r2_pulled), number(side.r2) if free is None else free),
        haptics=operator is None or operator.haptics,
        nearest=None if robot is None or robot.nearest is None else printable(robot.nearest),
        nearest_mm=None if robot is None else number(robot.nearest_mm),
        has_target=None if scene.target is UNSET else scene.target is not None,
        target_mm=None if robot is None else number(robot.target_mm),
        target_centre_mm=None if operator is None else number(operator.target_centre_mm),
        holding=None if holding is None else printable(holding),
        stands=scene.stands is True,
    )


def number(value: float | None) -> float | None:
    """Return a finite number; None for everything else."""
    return value if value is not None and -_LARGEST < value < _LARGEST else None
