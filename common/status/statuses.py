"""The status of each side: what its JSON lines, recordings and everything that people look at are made of.

None is not known. A program finds every key in every line, but for `target` while nobody has looked for one. All
distances are perceived ones, never the simulation's truth.
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
"""The triggers are written as on the controller."""


class SideStatus(msgspec.Struct, frozen=True, kw_only=True, rename=_KEYS):
    """What both sides say."""

    link: LinkState = LinkState.WAITING
    state: MotionState | None = None
    """The arm's"""
    stopped_because: str | None = None
    """Why it is armed no more, for people"""
    owner: SessionState | None = None
    """The robot side: where the owner stands, None for none. The operator side: where we stand"""
    l2: float | None = None
    """Stiffness, 0 to 1"""
    r2: float | None = None
    l2_pulled: float | None = None
    """Calibrated travel, 0 to 1"""
    r2_pulled: float | None = None
    delay_ms: float | None = None
    """From the other side to this one"""
    target: str | UnsetType | None = UNSET
    """None: there is none"""
    stands: bool | None = None
    """Whether what is held stands on something"""
    rate_kbit_s: float | None = None
    """This and the next four: LinkReport"""
    queue_ms: float | None = None
    lost_percent: float | None = None
    pictures: str | None = None
    held_back: str | None = None
    offset_s: float | None = None
    """What the other side's clock is ahead of this one's"""


class RobotStatus(SideStatus, frozen=True, kw_only=True):
    """What the robot side says."""

    observers: int = 0
    refused: int = 0
    """How many operators were not let in"""
    loop_age_ms: float | None = None
    """The delay that is reckoned with"""
    enlargement_mm: float | None = None
    holding: str | None = None
    """The object between the fingers"""
    nearest: str | None = None
    """The nearest object, supports aside"""
    nearest_mm: float | None = None
    """From the gripper's surface to it"""
    target_mm: float | None = None
    tick_us: float | None = None
    """This and the next four: of the ticks since the status before, of the process alone"""
    tick_p99_us: float | None = None
    overruns: int | None = None
    late_us: float | None = None
    real_time: float | None = None
    """The simulation's share of it"""


class OperatorStatus(SideStatus, frozen=True, kw_only=True):
    """What the operator side says; L2 and R2 are the controller's own, whatever the sides mean."""

    link_reason: str | None = None
    """Why it is refused, for people"""
    place: int | None = None
    """Ours among those who observe, 1 is next"""
    waiting: int | None = None
    """How many observe"""
    haptics: bool = True
    """Whether the triggers are stiffened at all; else L2 and R2 only say how near danger is"""
    feel: Sight | None = None
    l2_free: float | None = None
    """Calibrated travel from which on it stiffens, 0 to 1"""
    r2_free: float | None = None
    target_centre_mm: float | None = None
    """From the point between the fingertips to the target's centre"""
    holding: bool | None = None
    controller: ConnectionState | None = None
    """This and the following: of the process alone"""
    triggers_released: bool | None = None
    person: Doing | None = None
    """What the hands at a simulated controller do"""
    motion_overruns: int | None = None
    queue_to_robot_ms: float | None = None


_OPERATORS_OWN: Final = ("link", "state", "owner", "delay_ms", "L2", "R2", "L2_pulled", "R2_pulled")
"""What both sides say, and the operator side knows better."""


def joined(robot: RobotStatus | None, operator: OperatorStatus | None) -> dict[str, Any]:
    """What both sides know, by key: of controller and link what the operator side says, of the rest the robot side."""
    ours, theirs = ({} if one is None else msgspec.to_builtins(one) for one in (operator, robot))
    return {**ours, **theirs, **{name: ours[name] for name in _OPERATORS_OWN if name in ours}}
