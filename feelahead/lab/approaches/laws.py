"""Laws that are compared, each a way from the situation to the strengths that the fingers feel."""

from typing import Final, Literal, get_args

from common.protocol.messages import Compensation
from robot_side.laws.named import LawName

TriedLaw = Literal["swept", "swept_robot", "paper", "none", "full"]
"""swept: contact distances along each trigger, rendered over its travel (docs/feel.md); compensation by the operator.
swept_robot: the same with v t_d by the robot side (--compensation robot). paper: the printed law (§4.2), the total
overlap over a fixed share of the enlarged gripper. none: no haptics. full: always the strongest effect on both
triggers."""
LAWS: Final[tuple[TriedLaw, ...]] = get_args(TriedLaw)


def with_compensation(law: TriedLaw, compensation: Compensation) -> TriedLaw:
    """Return the law with this side compensating the delay; it makes a difference for `swept` only."""
    return "swept_robot" if law == "swept" and compensation == "robot" else law


def without_compensation(law: TriedLaw) -> str:
    """Return the name that `--law` has for this law."""
    return "swept" if law == "swept_robot" else law


def in_words(law: TriedLaw) -> str:
    """Return the law's name as it is printed."""
    return "swept, delay by the robot" if law == "swept_robot" else law


def compensation_of(law: TriedLaw) -> Compensation:
    """Return the side that compensates the delay."""
    return "robot" if law in ("swept_robot", "paper") else "operator"


def law_of_robot(law: TriedLaw) -> LawName:
    """Return the law that the robot side's settings must name."""
    return "paper" if law == "paper" else "swept"
