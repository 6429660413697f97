"""Facts of a run at one moment, as the operator side knows them.

Source of the console, the terminal view and the recording.
"""

from enum import StrEnum
from typing import Literal

import msgspec

from common.protocol.messages import Telemetry
from common.status.codes import Hands
from common.status.statuses import OperatorStatus, RobotStatus

Ten = tuple[int, int, int, int, int, int, int, int, int, int]


class TriggerFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Facts of one of the controller's own triggers."""

    travel: float | None
    """Calibrated travel, 0 to 1; None without a controller"""
    raw: float | None
    """Raw travel as the controller reports it, 0 to 1: the zones divide it"""
    zones: Ten
    """Strength of each tenth of the travel as last written, 0 to 8"""
    meets: int
    """Strength at the finger's present travel, 0 to 8"""
    free: float
    """Calibrated travel at which it stiffens, 0 to 1"""
    stiffness: float | None
    """s(δ) by the robot side, 0 to 1; None without a field"""
    needed_m: float | None
    """D at the present travel, the distance to feel ahead; None without a field"""
    fast_m: tuple[float, ...]
    """Onset distances of the eight strengths; empty without a field"""
    slow_m: tuple[float, ...]


class DelayFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Delay in one direction of the link, over the last second."""

    asked: str
    """Emulated profile in the grammar's words; empty for none, or if the other side emulates it"""
    mean_ms: float | None
    p99_ms: float | None
    newest_ms: float | None


class HandsFacts(msgspec.Struct, frozen=True):
    """Facts for a page that drives, or that must say why it cannot."""

    may_drive: bool
    """Whether a page may drive: not while a real controller does"""
    driver: str | None
    """Word that identifies the page that drives; None for none"""
    person: bool
    """Whether there is a scripted person to continue"""
    tuning_refused: str
    """Reason why the last tuning wish was refused; empty if it was not"""
    link_asked: str | None
    """Link of this side's last tuning wish, in netem's words; None before the first"""
    counts: float = 1.0
    """Share of a page's motion that counts, 0 to 1: less while the pictures are old"""
    reset_first: bool = False
    """Whether a stop must be reset before a page's hands count"""


class PictureFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of the pictures' freshness by view, in the order of VIEW_NAMES."""

    old_s: tuple[float | None, ...]
    """Age from which a picture is old; None while unknown"""
    dead_s: tuple[float, ...]
    """Silence from which a view is dead"""


class SceneFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Overlap and tick times of the robot side's scene."""

    overlap_mm3: float
    """Overlap of the trigger that has more ahead"""
    tick_us: float
    tick_p99_us: float
    overruns: int


class OperatorFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Facts of the operator side at one moment."""

    now_s: float
    """Time on this machine's monotonic clock, which is the console's, too"""
    offset_s: float | None
    """Robot side's clock minus ours: a stamp of the robot side minus this is our time; None while unknown"""
    status: OperatorStatus
    screen: Telemetry | None
    """Newest telemetry of the robot side"""
    l2: TriggerFacts
    r2: TriggerFacts
    rumble: float
    """Stronger motor's drive as last written, 0 to 1"""
    advancing: Literal["L2", "R2"]
    """Trigger that advances"""
    to_operator: DelayFacts
    to_robot: DelayFacts
    """Estimate: the round trip less the delay to here, or half the round trip if that is unknown"""
    round_trip_ms: float | None
    field_age_ms: float | None
    """Time since the newest stiffness arrived; None before the first"""
    hands: Hands
    may_tune: bool
    """Whether this operator may change P and the emulated link"""
    probability: float | None
    """P of the robot side; None while unknown"""
    page: HandsFacts | None = None
    """None if pages can neither drive nor stop"""
    pictures: PictureFacts | None = None
    scene: SceneFacts | None = None
    robot: RobotStatus | None = None
    """Given where both sides' statuses are known: in the demo, and in a recording of both"""


class ShownKind(StrEnum):
    """Kinds of messages to a page."""

    RUN = "run"
    """Constants of a run"""
    FACTS = "facts"
    SCENE = "scene"
    NOTE = "note"
    PLAYER = "player"
    """Position in a recording"""
    END = "end"
    """End of a round: the next message follows once the page has taken all up to here"""


FACTS_PERIOD_S = 1.0 / 30.0
