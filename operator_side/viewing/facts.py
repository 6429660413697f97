"""All that a person may want to see of a run at one moment, as the operator side knows it.

The console, the terminal view and the recording are all made of it.
"""

import msgspec

from common.command.live_view import Value

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


class HandsFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a page has to know to drive, or to say why it cannot"""

    may_drive: bool
    """Whether a page can drive at all: not where a real controller does"""
    driver: str | None
    """The word by which the page that drives calls itself; None while none does"""
    readiness: str
    """operator_side/viewing/pages/driving_page.py: nobody drives, all keys up first, ready, running"""
    rest_s: float
    """For how long all keys still have to be up before hold-to-run counts"""
    person: bool
    """Whether there is a scripted person who could go on"""
    doing: str
    """What whoever has the controller does, in a word; empty for a real controller"""
    tuning_refused: str
    """Why the last wish to tune was refused; empty where it was not"""
    link_asked: str | None
    """The link that was asked for last from here, in netem's words; None while nothing was"""


class OperatorFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One moment of the operator side."""

    now_s: float
    """On this machine's monotonic clock, which is the console's, too"""
    offset_s: float | None
    """What the robot side's clock is ahead of ours: a stamp of its less this is on our clock; None while unknown"""
    status: dict[str, Value]
    """As the status line is made of (common/command/live_view.py)"""
    l2: TriggerFacts
    r2: TriggerFacts
    rumble: float
    """As written to the motors, 0 to 1"""
    advancing: str
    """Which of the two advances: L2 or R2"""
    to_operator: DelayFacts
    to_robot: DelayFacts
    """As far as this side knows: half of what the round trip leaves, where it cannot be told"""
    round_trip_ms: float | None
    field_age_ms: float | None
    """Since the newest stiffness arrived; None before the first"""
    hands: str
    """Whose hands move the arm: controller, person (scripted) or browser"""
    may_tune: bool
    """Whether the robot side lets this operator change P and the emulated link"""
    probability: float | None
    """P as the robot side has it; None while it has not said"""
    page: HandsFacts | None = None
    """None where there is nothing for pages to drive or to stop"""


FACTS_PERIOD_S = 1.0 / 30.0
