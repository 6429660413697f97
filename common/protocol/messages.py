"""Every message that crosses the link, frozen and validated when it is made and when it is decoded.

    operator ── Hello, MotionCommand, Watch, Tune ──▶ robot     control, ROUTER/DEALER
    robot ── Hello, LeaseNotice, LinkReport, StiffnessUpdate ──▶ operator   control
    robot ── Telemetry ──▶ whoever looks                    view, PUB/SUB; view_messages.py has the others

A field out of range or not finite makes the whole message invalid: nothing of it is ever applied.
"""

import math
from collections.abc import Iterable
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from common.limits import Finite, Share, check_limits
from common.protocol.around import Around
from common.protocol.session import SessionState

Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]

MotionState = Literal["disarmed", "armed", "stopped"]
Ways = tuple[float, float, float, float, float, float, float, float]
Compensation = Literal["operator", "robot"]
"""Who reckons with the delay: the operator side by its own commands under way, or the robot side by eq. 8."""

_LARGEST = 2**63 - 1
_FARTHEST_M = 100.0
_SLOWEST = 2.0**-20
_Words = Annotated[str, Meta(max_length=200)]
_Number = Annotated[int, Meta(ge=0, le=_LARGEST)]
_Few = Annotated[int, Meta(ge=0, le=1000)]
_Far = Annotated[float, Meta(ge=0.0, le=_FARTHEST_M)]
_Place = tuple[Finite, Finite, Finite]
_Component = Annotated[float, Meta(ge=-1.0 - 2.0**-10, le=1.0 + 2.0**-10)]
"""A component of a unit vector, with room for rounding."""

# Every limit is one that single precision holds exactly: what is valid stays valid on the wire.
# Messages that are made up to 1000 times a second check their ranges by hand: `check_limits` takes four times as long.


def _in_range(name: str, low: float, high: float, value: float) -> None:
    if not low <= value <= high:  # false for NaN, too
        raise ValueError(f"{name} = {value}; valid: {low} to {high}")


def _all_in_range(name: str, low: float, high: float, values: Iterable[float]) -> None:
    for value in values:
        _in_range(name, low, high, value)


def _finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise ValueError(f"{name} = {value}; valid: a finite number")


def _rising(name: str, ways: Ways) -> None:
    a, b, c, d, e, f, g, h = ways
    if -_FARTHEST_M <= a <= b <= c <= d <= e <= f <= g <= h <= _FARTHEST_M:  # two of these are made in each tick
        return
    _all_in_range(name, -_FARTHEST_M, _FARTHEST_M, ways)
    raise ValueError(f"{name} = {ways}; valid: eight ways, none shorter than the one before")


def _both_or_neither(name: str, sent_s: float | None, held_s: float | None) -> None:
    if sent_s is None or held_s is None:
        if sent_s is not held_s:
            raise ValueError(f"{name}_sent_s and {name}_held_s; valid: both or neither")
        return
    _finite(f"{name}_sent_s", sent_s)
    _in_range(f"{name}_held_s", 0.0, 1e9, held_s)


class Header(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Who sent it when, and which stamp of ours came back: four-timestamp delay estimation for free."""

    epoch: int
    """Identifies one life of the sending process; a restart makes a new one."""
    sequence: int
    """Grows by one with each message of the epoch, whatever its kind."""
    sent_s: float
    """The sender's monotonic clock when the message entered its delay line."""
    echo_sent_s: float | None = None
    """The newest `sent_s` that the sender has received from us, on our clock."""
    echo_held_s: float | None = None
    """How long the sender held that stamp, on its clock."""
    last_sent_s: float | None = None
    """The `sent_s` of ours that arrived last at the sender, where a newer one had overtaken it: the newest stamps
    alone would make delays look shorter than they are."""
    last_held_s: float | None = None
    """How long the sender held that one, on its clock."""

    def __post_init__(self) -> None:
        _in_range("epoch", 0, _LARGEST, self.epoch)
        _in_range("sequence", 0, _LARGEST, self.sequence)
        _finite("sent_s", self.sent_s)
        _both_or_neither("echo", self.echo_sent_s, self.echo_held_s)
        if self.last_sent_s is not None or self.last_held_s is not None:  # which is rare
            _both_or_neither("last", self.last_sent_s, self.last_held_s)


class Message(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True, tag=True):
    """What all messages share; those that check more by hand, or much a second, replace the check of ranges."""

    header: Header

    def __post_init__(self) -> None:
        check_limits(self)


class Hello(Message, frozen=True, tag="hello"):
    """Opens an epoch, in either direction; repeated until the peer's has arrived."""

    side: Literal["operator", "robot"]
    clock_domain: _Words
    """Names the monotonic clock (common.clock.clock_domain): equal and not empty means a shared clock."""


class MotionCommand(Message, frozen=True, tag="motion"):
    """What the operator's hands do: travel, not velocity, for the robot side owns the mapping."""

    l2: float
    """Calibrated travel of the left trigger, 0 to 1."""
    r2: float
    lateral: Vector2 = (0.0, 0.0)
    """Left stick, right and up positive, -1 to 1 each."""
    turning: Vector2 = (0.0, 0.0)
    """Right stick, right and up positive, -1 to 1 each."""
    gripper: float = 0.0
    """-1 opens, +1 closes, 0 holds."""
    run: bool = False
    """The hold-to-run button is down."""
    arm: bool = False
    """The arming button is down."""
    emergency_stop: bool = False
    next_target: bool = False
    hand_over: bool = False
    """The button that passes the lease on to whoever has waited longest is down."""
    token: int = 0
    """The fencing token of the lease under which it was sent; none is 0."""
    compensation: Compensation = "operator"
    """Whose prediction of the delay's displacement is felt: eq. 10 takes that one's errors."""

    def __post_init__(self) -> None:
        _in_range("l2", 0.0, 1.0, self.l2)
        _in_range("r2", 0.0, 1.0, self.r2)
        _all_in_range("lateral", -1.0, 1.0, self.lateral)
        _all_in_range("turning", -1.0, 1.0, self.turning)
        _in_range("gripper", -1.0, 1.0, self.gripper)
        _in_range("token", 0, _LARGEST, self.token)


class Watch(Message, frozen=True, tag="watch"):
    """What the sender looks at, repeated a few times a second: what nobody looks at is not rendered."""

    overview: bool = False
    first_person: bool = False
    scene: bool = False
    """SceneShapes and SceneState"""
    lacks: tuple[_Number, _Number] | None = None
    """The newest VideoStep of each view that could not be shown, 0 for none; None: the sender can show JPEG alone."""


class Tune(Message, frozen=True, tag="tune"):
    """What the owner wants to be different while the run goes on; repeated until a notice says that it was taken."""

    number: Annotated[int, Meta(ge=1, le=_LARGEST)]
    """Grows with each wish."""
    probability: Annotated[float, Meta(ge=1e-6, le=1.0 - 1e-6)] | None = None
    """P of eq. 10, within (0, 1); None leaves it."""
    link: _Words | None = None
    """The emulated link of both directions in netem's words, none for an empty text; None leaves it."""


class LeaseNotice(Message, frozen=True, tag="lease"):
    """Where the receiver stands with the robot side; repeated, so that a lost one does no harm."""

    session: SessionState
    why: _Words
    """Why it stands there."""
    token: _Number
    """The fencing token of the present lease; it only grows. 0 before the first."""
    waiting: _Few
    """How many observe."""
    place: _Few = 0
    """The receiver's place among them, or the one that an unknown peer would get: 1 is next, 0 owns."""
    may_tune: bool = False
    """True if the run lets its owner tune."""
    probability: Share | None = None
    """P as it is now."""
    tuned: _Number = 0
    """The number of the receiver's newest wish to tune that arrived, granted or not."""


class LinkReport(Message, frozen=True, tag="report"):
    """The robot side's view of the link to the owner, twice a second."""

    rate_kbit_s: Annotated[float, Meta(ge=0.0, le=1e9)]
    """Allowed by the rate control, for all that the robot side sends."""
    queue_ms: Annotated[float, Meta(ge=0.0, le=1e9)]
    """In front of the robot side's own messages."""
    lost: Share | None
    """Share of the packets to the owner that the kernel sent again, since the last report; None for none sent."""
    pictures: _Words
    """How often and how well they are made."""
    held_back: _Words
    """The streams that gave way since the last report, and why; empty for none."""

    def values(self) -> dict[str, float | str | None]:
        """The same as fields of a status (common/status)."""
        return {
            "rate_kbit_s": self.rate_kbit_s,
            "queue_ms": self.queue_ms,
            "lost_percent": None if self.lost is None else 100.0 * self.lost,
            "pictures": self.pictures,
            "held_back": self.held_back,
        }


class TriggerField(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """What lies ahead along one trigger: how far the gripper may go before each of eight strengths is due (§4.2)."""

    fast_m: Ways
    """The ways from here, never falling, at which strengths 1 to 8 begin; `horizon_m` for those beyond it. Below 0: the
    gripper is past it."""
    slow_m: Ways
    """The same for zones so slow that what is to be touched may be touched."""
    full_speed_m_s: float
    """v_max: what a fully pulled trigger commands in this pose."""
    acceleration_m_s2: float
    """a: the least that the joints give along the trigger's direction in this pose."""
    displacement_m: float
    """δ by the robot side, along the trigger: v t_d (eq. 8); v_max t_d while it does not know what is under way."""
    stiffness: float
    """s(δ) of the fast list, 0 to 1."""

    def __post_init__(self) -> None:
        _rising("fast_m", self.fast_m)
        _rising("slow_m", self.slow_m)
        _in_range("full_speed_m_s", _SLOWEST, _FARTHEST_M, self.full_speed_m_s)
        _in_range("acceleration_m_s2", _SLOWEST, 1e6, self.acceleration_m_s2)
        _in_range("displacement_m", -_FARTHEST_M, _FARTHEST_M, self.displacement_m)
        _in_range("stiffness", 0.0, 1.0, self.stiffness)


class StiffnessUpdate(Message, frozen=True, tag="stiffness"):
    """What the operator's fingers are to feel (§4.2): fields that the operator side renders over the travel."""

    l2: TriggerField
    r2: TriggerField
    speed_m_s: float
    """v of the gripper along the direction in which R2 advances."""
    horizon_m: float
    """So far both fields look ahead; what is beyond is not known."""
    rumble: float
    """Danger where the stick leads, in eighths, 0 to 1; 0 while the stick rests."""
    state: MotionState
    told_m_s: float | None = None
    """The speed along that direction that the newest command gets, once joints' limits, discarded and stopped commands
    are through; None where nobody knows: that command is then taken to be followed."""
    stands: bool = False
    """What is held stands on something: nothing moves it farther down."""
    around: Around | None = None
    """Where sticks may lead; in a few messages only, and the newest holds."""

    def __post_init__(self) -> None:
        _in_range("speed_m_s", -_FARTHEST_M, _FARTHEST_M, self.speed_m_s)
        if self.told_m_s is not None:
            _in_range("told_m_s", -_FARTHEST_M, _FARTHEST_M, self.told_m_s)
        _in_range("horizon_m", 0.0, _FARTHEST_M, self.horizon_m)
        _in_range("rumble", 0.0, 1.0, self.rumble)


class Telemetry(Message, frozen=True, tag="telemetry", array_like=False):
    """What the operator's screen shows of the robot; never used for control by the robot side.

    compact.py packs the fields as they stand here: numbers, places, and what is true or known. Recordings, exports, and
    OperatorFacts.screen have a new one by itself.
    """

    state: MotionState
    tool_position_m: _Place
    """Estimated, in the world frame."""
    target: str | None
    """The present target's name; None when there is none."""
    target_in_tool_m: _Place | None
    """The perceived target's centre in the tool frame; +z is the approach axis."""
    up_in_tool: tuple[_Component, _Component, _Component]
    """The world's upward direction in the tool frame: an artificial horizon."""
    tool_speed_m_s: _Far
    gripper_opening_m: Annotated[float, Meta(ge=0.0, le=10.0)]
    holding: bool
    enlargement_m: _Far
    """The largest over the gripper's spheres."""
    l2: Share
    r2: Share


AnyMessage = Hello | MotionCommand | Watch | Tune | LeaseNotice | LinkReport | StiffnessUpdate | Telemetry
