"""Laws that are compared: from the situation to the strengths that the fingers feel."""

from typing import Final, Literal, get_args

from common.protocol.messages import Compensation
from robot_side.laws.named import LawName

Law = Literal["swept", "swept_robot", "paper", "none", "full"]
"""swept: contact distances along each trigger, rendered over its travel (docs/feel.md); compensation by the operator.
swept_robot: the same with v t_d by the robot side (--compensation robot). paper: the printed law (§4.2), the total
overlap over a fixed share of the enlarged gripper. none: no haptics. full: always the strongest effect on both
triggers."""
LAWS: Final[tuple[Law, ...]] = get_args(Law)


def with_compensation(law: Law, compensation: Compensation) -> Law:
    """Choose the side that compensates the delay; only swept leaves the choice."""
    return "swept_robot" if law == "swept" and compensation == "robot" else law


def without_compensation(law: Law) -> str:
    """Return the law's name in --law."""
    return "swept" if law == "swept_robot" else law


def in_words(law: Law) -> str:
    """Return the law's name for people."""
    return "swept, delay by the robot" if law == "swept_robot" else law


def compensation_of(law: Law) -> Compensation:
    """Return the side that compensates the delay."""
    return "robot" if law in ("swept_robot", "paper") else "operator"


def law_of_robot(law: Law) -> LawName:
    """Return the law for the robot side's settings."""
    return "paper" if law == "paper" else "swept"
