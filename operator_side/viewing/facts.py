"""Facts of a run at one moment, as the operator side knows them.

The console, the terminal view and the recording are made from these facts.
"""

from enum import StrEnum
from typing import Literal

import msgspec

from common.protocol.messages import Telemetry
from common.status.codes import InputSource
from common.status.statuses import OperatorStatus, RobotStatus

Ten = tuple[int, int, int, int, int, int, int, int, int, int]


class TriggerFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Facts of one of the controller's own triggers."""

    travel: float | None
    """Calibrated travel, 0 to 1; None without a controller"""
    raw: float | None
    """Raw travel as the controller reports it, 0 to 1; None without a controller"""
    zones: Ten
    """Strength of each of the ten zones as last written to the controller, 0 to 8"""
    meets: int
    """Strength of the zone at the present travel, 0 to 8: what the finger feels now"""
    free: float
    """Calibrated travel, 0 to 1, at which the first zone with a strength above 0 begins"""
    course_stiffness: float | None
    """Stiffness s(δ) of §4.2 to which the present course along the trigger leads, by the robot side, 0 to 1; None
    without a field. What the trigger meets now is `meets`"""
    needed_m: float | None
    """Distance D_z (`feel/zones.py`) that must be felt ahead at the present travel, along the trigger; None without a
    field"""
    fast_m: tuple[float, ...]
    """Onset distances of the eight strengths along the trigger, for fast zones (45 mm/s or more); empty if unknown"""
    slow_m: tuple[float, ...]
    """Onset distances of the eight strengths along the trigger, for slow zones (below 45 mm/s); empty if unknown"""


class DelayFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Delay in one direction of the link, over the last second."""

    asked: str
    """Delay profile that this side emulates, in netem's words; empty if it emulates none"""
    mean_ms: float | None
    """Mean one-way delay of the last second; None while unknown"""
    p99_ms: float | None
    """99th percentile of the one-way delays of the last second; None while unknown"""
    newest_ms: float | None
    """One-way delay of the newest message; None while unknown"""


class HandsFacts(msgspec.Struct, frozen=True):
    """Facts for a console page: whether it may drive the arm, and which page does."""

    may_drive: bool
    """Whether pages may drive the arm; False if a real controller drives"""
    driver: str | None
    """Word by which the driving page identifies itself; None if no page drives"""
    person: bool
    """Whether a page may hand the controls back to a scripted person"""
    tuning_refused: str
    """Reason why the last request to change P or the link was refused; empty if it was not"""
    link_asked: str | None
    """Link that this side last asked to emulate, in netem's words; None before the first request"""
    counts: float = 1.0
    """Share of a page's motion that counts, 0 to 1: less while the pictures are old, or the page is late"""
    reset_first: bool = False
    """Whether a stop must be reset before a page's hands count"""
    yields: tuple[bool, bool] = (False, False)
    """For L2 and R2, whether the pull of the page's keys yields to stiff zones, as a finger of 2 N would"""
    because: str = ""
    """Why less than all of a page's motion counts, with what was measured; empty if all counts"""
    released: str = ""
    """Why a page's inputs were last released without its doing, with what was measured; empty if they never were"""
    fewer: str = ""
    """Why pictures are fewer or smaller than the settings say, with what was measured; empty if they are not"""
    seldom: bool = False
    """Whether the scene and the charts are drawn less often, too"""


class PictureState(StrEnum):
    """State of the pictures of one view."""

    FRESH = "fresh"
    OLD = "old"
    """Pictures are older than the link explains"""
    DEAD = "dead"
    """No new picture comes"""


class PictureFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Freshness of the pictures by view, in the order of VIEW_NAMES."""

    old_s: tuple[float | None, ...]
    """Age from which a picture is old; None while unknown"""
    dead_s: tuple[float, ...]
    """Silence from which a view is dead"""
    states: tuple[PictureState, ...] = ()
    """States, which pages show; empty in recordings made before there were any"""


class SceneFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Overlap, and the robot side's tick times."""

    overlap_mm3: float
    """Volume shared with the gripper, inflated by D_σ and moved by δ along the trigger for which it is larger"""
    tick_us: float
    """Median duration of the robot side's recent ticks"""
    tick_p99_us: float
    """99th percentile of the durations of the robot side's recent ticks"""
    overruns: int
    """Number of missed deadlines of the robot side's turns, since the start"""


class OperatorFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Facts of the operator side at one moment."""

    now_s: float
    """Time on this machine's monotonic clock, which the console reads, too"""
    offset_s: float | None
    """Clock offset: the robot side's clock minus ours; None while unknown"""
    status: OperatorStatus
    screen: Telemetry | None
    """Newest telemetry of the robot side"""
    l2: TriggerFacts
    r2: TriggerFacts
    rumble: float
    """Stronger motor's drive as last written, 0 to 1"""
    advancing: Literal["L2", "R2"]
    """Trigger that moves the gripper forward"""
    to_operator: DelayFacts
    to_robot: DelayFacts
    """Estimate: the round trip less the delay to the operator; half the round trip if that delay is unknown"""
    round_trip_ms: float | None
    """Newest round trip, without the time for which the robot side held the message; None while unknown"""
    field_age_ms: float | None
    """Time since the newest stiffness message arrived; None before the first"""
    hands: InputSource
    """Owner of the controls: a controller, a scripted person or a browser"""
    may_tune: bool
    """Whether this operator may change P and the emulated link"""
    probability: float | None
    """Probability P of eq. 10, as the robot side uses it; None while unknown"""
    page: HandsFacts | None = None
    """Facts for console pages; None if pages can neither drive nor stop the arm"""
    pictures: PictureFacts | None = None
    scene: SceneFacts | None = None
    robot: RobotStatus | None = None
    """Robot side's status, where both sides run in one process or recording; else None"""

    @property
    def reset_first(self) -> bool:
        """Whether a stop waits for its reset by a page, so that nothing arms before."""
        return self.page is not None and self.page.reset_first


class ShownKind(StrEnum):
    """Kind of a message to a console page."""

    RUN = "run"
    """Constants of a run: title, and whether it is live"""
    FACTS = "facts"
    SCENE = "scene"
    NOTE = "note"
    PLAYER = "player"
    """Position in a recording, its length, speed and pause"""
    ENDED = "ended"
    """The run has ended normally"""
    END = "end"
    """End of a batch: the next batch follows once the page has confirmed this one"""


FACTS_PERIOD_S = 1.0 / 30.0
"""Period of facts to the console and the recording, in seconds"""
