"""Messages of the link, frozen; validated when made and when decoded.

    operator ── Hello, MotionCommand, Watch, Tune, Mark ──▶ robot   control, ROUTER/DEALER
    robot ── Hello, LeaseNotice, LinkReport, StiffnessUpdate ──▶ operator   control
    robot ── Telemetry ──▶ viewers                          view, PUB/SUB; view_messages.py has the others

A field out of range or not finite makes the whole message invalid: no part is applied.
"""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from common.episode import EpisodeMark
from common.limits import Finite, Share, check_limits
from common.protocol.around import Around
from common.protocol.ranges import FARTHEST_M, LATEST_S, all_in_range, both_or_neither, finite, in_range, rising
from common.protocol.session import SessionState

Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
MotionState = Literal["disarmed", "armed", "stopped"]
OnsetDistances = tuple[float, float, float, float, float, float, float, float]
Compensation = Literal["operator", "robot"]
"""Side that compensates the delay: "operator" by its commands under way, "robot" by v t_d (eq. 8)."""

_LARGEST = 2**63 - 1
_SLOWEST = 2.0**-20
_Words = Annotated[str, Meta(max_length=200)]
_Number = Annotated[int, Meta(ge=0, le=_LARGEST)]
_Few = Annotated[int, Meta(ge=0, le=1000)]
_Rate = Annotated[float, Meta(ge=0.1, le=1000.0)]
_Far = Annotated[float, Meta(ge=0.0, le=FARTHEST_M)]
_Place = tuple[Finite, Finite, Finite]
_Turn = Annotated[float, Meta(ge=-4.0, le=4.0)]
_Component = Annotated[float, Meta(ge=-1.0 - 2.0**-10, le=1.0 + 2.0**-10)]  # of a unit vector, with room for rounding
# Every limit is exact in single precision: a valid message stays valid on the wire.


class Header(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Epoch, sequence number and stamps of a message; the echoed stamps allow delay estimation from four timestamps."""

    epoch: int
    """Random number that identifies one run (epoch) of the sending side."""
    sequence: int
    """Number of the message in its epoch, counted over all kinds of messages together."""
    sent_s: float
    """Time at which the message entered its delay line, on the sender's monotonic clock."""
    echo_sent_s: float | None = None
    """The `sent_s`, on the receiver's clock, of the newest message that the sender has received from the receiver."""
    echo_held_s: float | None = None
    """Time from that message's arrival at the sender to `sent_s`, on the sender's clock."""
    last_sent_s: float | None = None
    """The `sent_s` of the receiver's message that arrived last at the sender, if a newer message had overtaken it; else
    None. The newest messages' stamps alone would bias the delays low."""
    last_held_s: float | None = None
    """Time from the arrival of the message of `last_sent_s` to `sent_s`, on the sender's clock."""

    def __post_init__(self) -> None:
        in_range("epoch", 0, _LARGEST, self.epoch)
        in_range("sequence", 0, _LARGEST, self.sequence)
        finite("sent_s", self.sent_s)
        both_or_neither("echo", self.echo_sent_s, self.echo_held_s)
        if self.last_sent_s is not None or self.last_held_s is not None:  # rare
            both_or_neither("last", self.last_sent_s, self.last_held_s)


class Message(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True, tag=True):
    """Base of all messages; frequent messages, and those with more conditions, replace this check of ranges."""

    header: Header

    def __post_init__(self) -> None:
        check_limits(self)


class Hello(Message, frozen=True, tag="hello"):
    """First message of an epoch, in either direction; repeated until the peer's Hello has arrived."""

    side: Literal["operator", "robot"]
    clock_domain: _Words
    """Name of the sender's monotonic clock (common.clock.clock_domain). If both sides' names are equal and not empty,
    the sides read the same clock."""


class MotionCommand(Message, frozen=True, tag="motion"):
    """The operator's inputs: triggers, sticks and buttons. The robot side maps them to velocities."""

    l2: float
    """Calibrated travel of the left trigger, 0 to 1."""
    r2: float
    """Calibrated travel of the right trigger, 0 to 1."""
    lateral: Vector2 = (0.0, 0.0)
    """Left stick, in the controller frame: right and up positive, -1 to 1 each."""
    turning: Vector2 = (0.0, 0.0)
    """Right stick, in the controller frame: right and up positive, -1 to 1 each."""
    gripper: float = 0.0
    """Motion of the gripper's fingers: -1 opens, +1 closes, 0 holds."""
    run: bool = False
    """Whether the hold-to-run button is down."""
    arm: bool = False
    """Whether the arming button is down."""
    emergency_stop: bool = False
    """Whether the emergency stop is down."""
    next_target: bool = False
    """Whether the button for the next target is down."""
    home: float = 0.0
    """Share of full speed at which to move to the start pose, 0 for not at all; only while triggers and sticks rest."""
    hand_over: bool = False
    """Whether the hand-over button is down: the lease then passes to the observer who has waited longest."""
    token: int = 0
    """Fencing token of the lease under which the command was sent; 0 for none."""
    compensation: Compensation = "operator"
    """Side that compensates the delay; eq. 10 uses the prediction errors of that side's compensation."""

    def __post_init__(self) -> None:
        in_range("l2", 0.0, 1.0, self.l2)
        in_range("r2", 0.0, 1.0, self.r2)
        all_in_range("lateral", -1.0, 1.0, self.lateral)
        all_in_range("turning", -1.0, 1.0, self.turning)
        in_range("gripper", -1.0, 1.0, self.gripper)
        in_range("home", 0.0, 1.0, self.home)
        in_range("token", 0, _LARGEST, self.token)


class Watch(Message, frozen=True, tag="watch"):
    """Views that the sender shows at present, repeated a few times a second; the robot side renders no others."""

    overview: bool = False
    first_person: bool = False
    scene: bool = False
    """Whether the sender wants SceneShapes and SceneState"""
    lacks: tuple[_Number, _Number] | None = None
    """For each view, `number` of the newest VideoStep that could not be shown, 0 for none. None: the sender can show
    only JPEG."""
    picture_hz: _Rate | None = None
    """Most pictures of each view in a second that the sender keeps up with; None for no limit"""
    halved: bool = False
    """Whether the sender keeps up only with pictures of half the width and height"""
    scene_hz: _Rate | None = None
    """Most states of the scene in a second, likewise"""


class Tune(Message, frozen=True, tag="tune"):
    """Changes of settings requested by the lease's owner during the run; repeated until a LeaseNotice confirms them."""

    number: Annotated[int, Meta(ge=1, le=_LARGEST)]
    """Number of the request; each new request has a higher one."""
    probability: Annotated[float, Meta(ge=1e-6, le=1.0 - 1e-6)] | None = None
    """Probability P of eq. 10, within (0, 1); None for no change."""
    link: _Words | None = None
    """Emulation of the link in both directions, in netem's words; empty for no emulation, None for no change."""


class Mark(Message, frozen=True, tag="mark"):
    """Numbered mark of an episode; `reset` asks for the scene to be put back. Repeated until a notice answers it."""

    number: Annotated[int, Meta(ge=1, le=_LARGEST)]
    kind: EpisodeMark


class LeaseNotice(Message, frozen=True, tag="lease"):
    """Session state, at the robot side, of the operator who receives the notice; repeated in case a notice is lost."""

    session: SessionState
    why: _Words
    """Reason of that state, for people."""
    token: _Number
    """Fencing token of the present lease, which grows with each lease; 0 before the first lease."""
    waiting: _Few
    """Number of observers."""
    place: _Few = 0
    """Position in the queue of observers: 1 gets the lease next, 0 is not queued. For an unknown peer, the position
    that it would get; 0 if it would get the lease."""
    may_tune: bool = False
    """Whether the robot side's settings let the lease's owner use Tune."""
    probability: Share | None = None
    """Present probability P of eq. 10."""
    tuned: _Number = 0
    """Number of the receiver's newest Tune that arrived, granted or not."""
    marked: _Number = 0
    mark_refused: _Words = ""
    """Why the receiver's newest Mark, of the number `marked`, was refused; empty if it was accepted."""


class LinkReport(Message, frozen=True, tag="report"):
    """State of the link to the lease's owner as the robot side measures it, sent twice a second."""

    rate_kbit_s: Annotated[float, Meta(ge=0.0, le=1e9)]
    """Rate that the rate control allows for all messages of the robot side together."""
    queue_ms: Annotated[float, Meta(ge=0.0, le=1e9)]
    """Queueing delay of the robot side's messages."""
    lost: Share | None
    """Share of the packets to the owner since the last report that the kernel sent again; None if there were none."""
    pictures: _Words
    """Rate and quality of the pictures."""
    held_back: _Words
    """Streams of which messages were held back since the last report, and why; empty for none."""

    def values(self) -> dict[str, float | str | None]:
        """Return the report as fields of a status (common/status)."""
        shown = {name: getattr(self, name) for name in ("rate_kbit_s", "queue_ms", "pictures", "held_back")}
        return shown | {"lost_percent": None if self.lost is None else 100.0 * self.lost}


class TriggerField(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Onset distances of the eight strengths along one trigger (§4.2)."""

    fast_m: OnsetDistances
    """Advances from here along the trigger at which strengths 1 to 8 begin, in ascending order, for fast zones;
    `horizon_m` for those beyond the horizon. Below 0: the gripper is past the onset."""
    slow_m: OnsetDistances
    """Advances from here along the trigger at which strengths 1 to 8 begin, for slow zones, whose commanded speed is so
    low that touching the target is allowed."""
    full_speed_m_s: float
    """v_max: speed along the trigger's direction that a full pull commands in this pose."""
    acceleration_m_s2: float
    """a: acceleration along the trigger's direction that the joints are sure to reach in this pose."""
    displacement_m: float
    """δ along the trigger by the robot side: v t_d (eq. 8); v_max t_d while the commands under way are unknown."""
    course_stiffness: float
    """Stiffness s(δ) to which the present course along the trigger leads, by `fast_m` after the advance
    `displacement_m`, 0 to 1; not what the trigger meets now."""

    def __post_init__(self) -> None:
        rising("fast_m", self.fast_m)
        rising("slow_m", self.slow_m)
        in_range("full_speed_m_s", _SLOWEST, FARTHEST_M, self.full_speed_m_s)
        in_range("acceleration_m_s2", _SLOWEST, 1e6, self.acceleration_m_s2)
        in_range("displacement_m", -FARTHEST_M, FARTHEST_M, self.displacement_m)
        in_range("course_stiffness", 0.0, 1.0, self.course_stiffness)


class StiffnessUpdate(Message, frozen=True, tag="stiffness"):
    """Trigger fields (§4.2), which the operator side renders as strengths over each trigger's travel."""

    l2: TriggerField
    r2: TriggerField
    speed_m_s: float
    """v: speed of the gripper along R2's direction."""
    horizon_m: float
    """Horizon of both fields, along each trigger."""
    rumble: float
    """Rumble, 0 to 1 in eighths: strength in the direction of the stick; 0 while the stick rests."""
    state: MotionState
    """State of the arm: disarmed, armed or stopped"""
    commanded_m_s: float | None = None
    """Commanded speed along R2's direction: what remains of the newest command after joint limits; 0 if it was stopped.
    None if unknown: the arm then counts as following the command."""
    stands: bool = False
    """Whether the held object is supported, so that it cannot move farther down."""
    hindered: bool = False
    """Whether something keeps the arm from following the command (`Telemetry.hindrance`)."""
    around: Around | None = None
    """Onset distances around the gripper. Only a few messages have them; they hold until the next."""
    response_s: float = 0.0
    """Time from a command's arrival at the robot side until the arm follows it; in steps of 4 ms on the wire"""

    def __post_init__(self) -> None:
        in_range("speed_m_s", -FARTHEST_M, FARTHEST_M, self.speed_m_s)
        in_range("response_s", 0.0, LATEST_S, self.response_s)
        if self.commanded_m_s is not None:
            in_range("commanded_m_s", -FARTHEST_M, FARTHEST_M, self.commanded_m_s)
        in_range("horizon_m", 0.0, FARTHEST_M, self.horizon_m)
        in_range("rumble", 0.0, 1.0, self.rumble)


class Telemetry(Message, frozen=True, tag="telemetry", array_like=False):
    """Values for the operator's screen; the robot side never controls by them.

    compact.py packs the fields by type. A field added here appears in recordings, exports and OperatorFacts.screen
    without further code.
    """

    state: MotionState
    """State of the arm: disarmed, armed or stopped"""
    tool_position_m: _Place
    """Estimated position (x, y, z) of the tool, in the world frame."""
    target: str | None
    """Name of the present target; None for none."""
    target_in_tool_m: _Place | None
    """Centre (x, y, z) of the perceived target in the tool frame; +z is the approach axis."""
    up_in_tool: tuple[_Component, _Component, _Component]
    """Unit vector (x, y, z) that points up in the world, in the tool frame; for an artificial horizon."""
    tool_speed_m_s: _Far
    """Speed of the tool, in any direction"""
    gripper_opening_m: Annotated[float, Meta(ge=0.0, le=10.0)]
    """Free gap between the fingers, along the jaws' motion; 0 without a gripper"""
    holding: bool
    """Whether an object is between the fingers"""
    enlargement_m: _Far
    """Enlargement of the gripper along the motion, D_incr = |v| t_d + D_σ (eq. 10); 0 before the loop age is known."""
    l2_course_stiffness: Share
    """Stiffness s(δ) to which the present course along L2 leads, 0 to 1"""
    r2_course_stiffness: Share
    """Stiffness s(δ) to which the present course along R2 leads, 0 to 1"""
    base_turn_rad: _Turn = 0.0
    """Angle in the tool frame, across the approach axis, from the tool's right to the base's; positive towards up"""
    camera_turn_rad: _Turn = 0.0
    """Angle in the tool frame, across the approach axis, from the tool's right to that of the overview; same sign"""
    camera_faces: bool = False
    """Whether the tool faces the overview's camera, so that up in the picture lies clockwise of right"""
    undone: Share = 0.0
    """Share of the commanded motion that the tool does not make, 0 to 1"""
    hindrance: _Words | None = None
    """Cause for which the arm does not follow the command, in words; None if it follows"""


AnyMessage = Hello | MotionCommand | Watch | Tune | Mark | LeaseNotice | LinkReport | StiffnessUpdate | Telemetry
