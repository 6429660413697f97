"""Status of each side, for JSON lines, recordings and pages.

None means unknown. Every line has every key, except `target` before the first search for one. All distances are
perceived ones, never the simulation's truth.
"""

from typing import Any, Final

import msgspec
from msgspec import UNSET, UnsetType

from common.protocol.messages import MotionState
from common.protocol.session import SessionState
from common.status.codes import ConnectionState, Doing, LinkState, Sight

_KEYS: Final = {
    f"{name.lower()}{figure}": f"{name}{figure}" for name in ("L2", "R2") for figure in ("", "_pulled", "_free")
}
"""JSON keys: the triggers' names are those on the controller."""


class SideStatus(msgspec.Struct, frozen=True, kw_only=True, rename=_KEYS):
    """Fields of both sides."""

    link: LinkState = LinkState.WAITING
    state: MotionState | None = None
    """State of the arm"""
    stopped_because: str | None = None
    """Reason why the arm is no longer armed, for people"""
    owner: SessionState | None = None
    """Robot side: session state of the owner, None for none. Operator side: our session state"""
    l2: float | None = None
    """Stiffness, 0 to 1"""
    r2: float | None = None
    l2_pulled: float | None = None
    """Calibrated travel, 0 to 1"""
    r2_pulled: float | None = None
    delay_ms: float | None = None
    """One-way delay from the other side to this one"""
    target: str | UnsetType | None = UNSET
    """Name of the target, None for none"""
    stands: bool | None = None
    """Whether the held object is supported"""
    rate_kbit_s: float | None = None
    """This and the next four: as in LinkReport"""
    queue_ms: float | None = None
    lost_percent: float | None = None
    pictures: str | None = None
    held_back: str | None = None
    offset_s: float | None = None
    """Clock offset of the other side"""


class RobotStatus(SideStatus, frozen=True, kw_only=True):
    """Status of the robot side."""

    observers: int = 0
    refused: int = 0
    """Number of operators that were not let in"""
    loop_age_ms: float | None = None
    """Delay that the law assumes"""
    enlargement_mm: float | None = None
    holding: str | None = None
    """Object between the fingers"""
    nearest: str | None = None
    """Nearest object, supports aside"""
    nearest_mm: float | None = None
    """Distance from the gripper's surface to it"""
    target_mm: float | None = None
    tick_us: float | None = None
    """This and the next four: of the ticks since the previous status, of the process alone"""
    tick_p99_us: float | None = None
    overruns: int | None = None
    late_us: float | None = None
    real_time: float | None = None
    """Speed of the simulation, as a share of real time"""


class OperatorStatus(SideStatus, frozen=True, kw_only=True):
    """Status of the operator side; L2 and R2 name the controller's triggers, whatever the sides mean."""

    link_reason: str | None = None
    """Reason of a refusal, for people"""
    place: int | None = None
    """Our place among the observers, 1 is next"""
    waiting: int | None = None
    """Number of observers"""
    haptics: bool = True
    """Whether the triggers are stiffened; else L2 and R2 only show the danger"""
    feel: Sight | None = None
    l2_free: float | None = None
    """Calibrated travel at which stiffness begins, 0 to 1"""
    r2_free: float | None = None
    target_centre_mm: float | None = None
    """Distance from the point between the fingertips to the target's centre"""
    holding: bool | None = None
    controller: ConnectionState | None = None
    """This and the following fields: of the process alone"""
    triggers_released: bool | None = None
    person: Doing | None = None
    """Action of the hands at a simulated controller"""
    motion_overruns: int | None = None
    queue_to_robot_ms: float | None = None


_OPERATORS_OWN: Final = ("link", "state", "owner", "delay_ms", "L2", "R2", "L2_pulled", "R2_pulled")
"""Keys of both sides of which the operator side's value wins."""


def joined(robot: RobotStatus | None, operator: OperatorStatus | None) -> dict[str, Any]:
    """Join both sides' values by key; the operator side wins for _OPERATORS_OWN, the robot side for the others."""
    ours, theirs = ({} if one is None else msgspec.to_builtins(one) for one in (operator, robot))
    return {**ours, **theirs, **{name: ours[name] for name in _OPERATORS_OWN if name in ours}}
