"""The laws that are compared: from what is ahead to what the fingers feel."""

from typing import Final, Literal, get_args

from robot_side.stiffness.map import StiffnessSettings

Law = Literal["first", "paper", "margin", "none", "full"]
"""first: stiffness by direction, 1 where a plane would be touched (README's). paper: the plain one of §4.2, the total
overlap over a fixed share of the enlarged gripper. margin: the first one with a fixed enlargement. none: no haptics.
full: always the strongest effect on both triggers, whatever is ahead."""
LAWS: Final[tuple[Law, ...]] = get_args(Law)
Compensation = Literal["robot", "operator"]
"""Who reckons with the delay: the robot side by eq. 8, or the operator side by the commands that are under way."""


def stiffness_settings(law: Law) -> StiffnessSettings:
    """The robot side's settings of a law."""
    return StiffnessSettings(mode="total", reference="fraction") if law == "paper" else StiffnessSettings()
