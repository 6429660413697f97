"""Status of each side, for JSON lines, recordings and pages.

None means unknown. Every JSON line has every key, except `target` before the first search for a target. All distances
are perceived ones, never the simulation's truth; only `placed` is true.
"""

from typing import Any, Final

import msgspec
from msgspec import UNSET, UnsetType

from common.protocol.messages import MotionState
from common.protocol.session import SessionState
from common.status.codes import ConnectionState, Doing, LinkState, Sight

_FIGURES: Final = ("meets", "course_stiffness", "pulled", "free")
_KEYS: Final = {f"{name.lower()}_{figure}": f"{name}_{figure}" for name in ("L2", "R2") for figure in _FIGURES}
"""JSON keys, by field: the triggers are named L2 and R2, as on the controller."""


class SideStatus(msgspec.Struct, frozen=True, kw_only=True, rename=_KEYS):
    """Fields that the status of either side has."""

    link: LinkState = LinkState.WAITING
    """State of the link: waiting, up, observing, refused or lost"""
    state: MotionState | None = None
    """State of the arm"""
    stopped_because: str | None = None
    """Reason why the arm is no longer armed, for people"""
    owner: SessionState | None = None
    """In the robot side's status: session state of the lease's owner, None without an owner. In the operator side's:
    its own session state"""
    l2_course_stiffness: float | None = None
    """Stiffness s(δ) to which the present course along L2 leads, 0 to 1; not what the trigger meets now"""
    r2_course_stiffness: float | None = None
    """Stiffness s(δ) to which the present course along R2 leads, 0 to 1; not what the trigger meets now"""
    l2_pulled: float | None = None
    """Calibrated travel of L2, 0 to 1"""
    r2_pulled: float | None = None
    """Calibrated travel of R2, 0 to 1"""
    delay_ms: float | None = None
    """One-way delay from the other side to this one"""
    target: str | UnsetType | None = UNSET
    """Name of the target, None for none"""
    stands: bool | None = None
    """Whether the held object is supported"""
    hindrance: str | None = None
    """Cause for which the arm does not follow the command, in words"""
    rate_kbit_s: float | None = None
    """Rate that the rate control allows for all messages of the robot side together"""
    queue_ms: float | None = None
    """Queueing delay of the robot side's messages"""
    lost_percent: float | None = None
    """Share of the packets to the lease's owner that the kernel sent again"""
    pictures: str | None = None
    """Rate and quality of the pictures, in words"""
    held_back: str | None = None
    """Streams of which messages were held back, and why, in words; empty for none"""
    offset_s: float | None = None
    """Clock of the other side minus ours"""


class RobotStatus(SideStatus, frozen=True, kw_only=True):
    """Status of the robot side."""

    observers: int = 0
    """Number of operators who wait for the lease"""
    refused: int = 0
    """Number of operators that were refused"""
    loop_age_ms: float | None = None
    """Loop age t_d that the law assumes (eq. 8)"""
    enlargement_mm: float | None = None
    """Enlargement of the gripper along the motion, D_incr = |v| t_d + D_σ (eq. 10)"""
    holding: str | None = None
    """Object between the fingers"""
    nearest: str | None = None
    """Nearest object that is not a support"""
    nearest_mm: float | None = None
    """Distance, in any direction, from the gripper's surface to the nearest object"""
    target_mm: float | None = None
    """Distance, in any direction, from the gripper's surface to the target"""
    placed: bool | None = None
    """Whether the simulated target was lifted and stands by itself; None with a real arm"""
    tick_us: float | None = None
    """Median duration of the ticks since the previous status; None unless the side runs in its own process, like the
    next five"""
    tick_p99_us: float | None = None
    """99th percentile of the ticks' durations"""
    period_ms: float | None = None
    """Present period of the robot side's turns: the one asked for, or a longer one if the machine cannot keep it"""
    overruns: int | None = None
    """Number of missed deadlines of turns, since the start"""
    late_us: float | None = None
    """Greatest lateness of a turn"""
    real_time: float | None = None
    """Speed of the simulation, as a share of real time"""


class OperatorStatus(SideStatus, frozen=True, kw_only=True):
    """Status of the operator side; L2 and R2 are the controller's physical triggers."""

    link_reason: str | None = None
    """Reason of a refusal, for people"""
    place: int | None = None
    """Our position in the queue of observers; 1 gets the lease next"""
    waiting: int | None = None
    """Number of observers"""
    haptics: bool = True
    """Whether the triggers are stiffened; if not, they meet 0"""
    speed_scale: float = 1.0
    """Share of the full speed that full travel commands"""
    stick_frame: str = "tool"
    """Frame in which the sticks move and turn the tool: tool, base or camera"""
    feel: Sight | None = None
    """Whether there is a recent trigger field"""
    l2_meets: int | None = None
    """Strength of L2's zone at the present travel, 0 to 8: what the finger feels now; None without a controller"""
    r2_meets: int | None = None
    """Strength of R2's zone at the present travel, 0 to 8: what the finger feels now; None without a controller"""
    l2_free: float | None = None
    """Calibrated travel of L2 at which its first stiff zone begins, 0 to 1"""
    r2_free: float | None = None
    """Calibrated travel of R2 at which its first stiff zone begins, 0 to 1"""
    target_centre_mm: float | None = None
    """Distance, in any direction, from the point between the fingertips to the target's centre"""
    holding: bool | None = None
    """Whether an object is between the fingers"""
    stop_reset: bool = False
    """Whether a page drives and no stop waits for its reset: a stopped arm then counts as disarmed"""
    controller: ConnectionState | None = None
    """State of the controller's connection; None unless the side runs in its own process, like those below"""
    triggers_released: bool | None = None
    """Whether the last write to the controller neither resists nor rumbles"""
    person: Doing | None = None
    """Action of the simulated person or of the page that drives"""
    motion_period_ms: float | None = None
    """Present period of the operator side's turns"""
    motion_overruns: int | None = None
    """Number of missed deadlines of the operator side's turns, since the start"""
    queue_to_robot_ms: float | None = None
    """Queueing delay of the operator side's messages"""


_OPERATORS_OWN: Final = ("link", "state", "owner", "delay_ms", *_KEYS.values())
"""Keys that both sides have and of which the operator side's value is used."""


def joined(robot: RobotStatus | None, operator: OperatorStatus | None) -> dict[str, Any]:
    """Merge both sides' values. Of common keys, _OPERATORS_OWN come from the operator side, others from the robot."""
    ours, theirs = ({} if one is None else msgspec.to_builtins(one) for one in (operator, robot))
    return {**ours, **theirs, **{name: ours[name] for name in _OPERATORS_OWN if name in ours}}
