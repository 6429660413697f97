"""All that a person may want to see of a run at one moment, as the operator side knows it.

The console, the terminal view and the recording are all made of it.
"""

from enum import StrEnum
from typing import Literal

import msgspec

from common.protocol.messages import Telemetry
from common.status.codes import Hands
from common.status.statuses import OperatorStatus, RobotStatus

Ten = tuple[int, int, int, int, int, int, int, int, int, int]


class TriggerFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One of the controller's own triggers."""

    travel: float | None
    """Calibrated, 0 to 1; None without a controller"""
    raw: float | None
    """As the controller reports it, 0 to 1: the zones lie along this one"""
    zones: Ten
    """Strength of each tenth of the travel as last written, 0 to 8"""
    meets: int
    """The strength that the finger meets where it is now, 0 to 8"""
    free: float
    """Calibrated travel from which on it stiffens, 0 to 1"""
    stiffness: float | None
    """s(δ) by the robot side, 0 to 1; None without a field"""
    needed_m: float | None
    """D at the present travel: by so much the gripper is moved ahead to be felt; None without a field"""
    fast_m: tuple[float, ...]
    """The ways at which the eight strengths begin; empty without a field"""
    slow_m: tuple[float, ...]


class DelayFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One direction of the link, over the last second."""

    asked: str
    """The emulated profile in the grammar's words; empty for none, or where the other side emulates it"""
    mean_ms: float | None
    p99_ms: float | None
    newest_ms: float | None


class HandsFacts(msgspec.Struct, frozen=True):
    """What a page has to know to drive, or to say why it cannot"""

    may_drive: bool
    """Whether a page can drive at all: not where a real controller does"""
    driver: str | None
    """The word by which the page that drives calls itself; None while none does"""
    person: bool
    """Whether there is a scripted person who could go on"""
    tuning_refused: str
    """Why the last wish to tune was refused; empty where it was not"""
    link_asked: str | None
    """The link that was asked for last from here, in netem's words; None while nothing was"""


class SceneFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Figures of the robot side's scene."""

    overlap_mm3: float
    """Of the trigger that has more ahead"""
    tick_us: float
    tick_p99_us: float
    overruns: int


class OperatorFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One moment of the operator side."""

    now_s: float
    """On this machine's monotonic clock, which is the console's, too"""
    offset_s: float | None
    """What the robot side's clock is ahead of ours: a stamp of its less this is on our clock; None while unknown"""
    status: OperatorStatus
    screen: Telemetry | None
    """The robot side's newest telemetry"""
    l2: TriggerFacts
    r2: TriggerFacts
    rumble: float
    """As written to the motors, 0 to 1"""
    advancing: Literal["L2", "R2"]
    """Which of the two advances"""
    to_operator: DelayFacts
    to_robot: DelayFacts
    """As far as this side knows: half of what the round trip leaves, where it cannot be told"""
    round_trip_ms: float | None
    field_age_ms: float | None
    """Since the newest stiffness arrived; None before the first"""
    hands: Hands
    may_tune: bool
    """Whether the robot side lets this operator change P and the emulated link"""
    probability: float | None
    """P as the robot side has it; None while it has not said"""
    page: HandsFacts | None = None
    """None where there is nothing for pages to drive or to stop"""
    scene: SceneFacts | None = None
    robot: RobotStatus | None = None
    """Where both sides' statuses are at hand: in the demo, and in a recording of both"""


class ShownKind(StrEnum):
    """What a message to a page is."""

    RUN = "run"
    """What does not change in a run"""
    FACTS = "facts"
    SCENE = "scene"
    NOTE = "note"
    PLAYER = "player"
    """Where in a recording we are"""
    END = "end"
    """No message follows before the page has said that it took all up to here"""


FACTS_PERIOD_S = 1.0 / 30.0
