"""Settings of both sides in a trial, the same for people and for simulated participants."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from feelahead.study.protocol import Condition, ControllerName
from feelahead.study.schedule import Planned
from robot_side.laws.paper_settings import MARGIN_M

DEVICES: Final[Mapping[ControllerName, str]] = {"dualsense": "hid", "gamepad": "evdev", "keyboard": "browser"}
"""Device of the operator side for each controller that a protocol may name"""
_JITTER_MS: Final = 10.0
"""Standard deviation of all delays but 0"""


class SideValues(NamedTuple):
    """Settings that a trial decides, by their names in `RobotSettings` and `OperatorSettings`."""

    robot: dict[str, Any]
    operator: dict[str, Any]


def side_values(planned: Planned, condition: Condition) -> SideValues:
    """Return what both sides of a trial are set to."""
    link = f"delay {planned.delay_ms:g}ms {_JITTER_MS:g}ms distribution normal" if planned.delay_ms else ""
    robot = {
        "scene": planned.scene,
        "seed": planned.seed,
        "link": link,
        "law": condition.law,
        "law_margin_m": condition.margin_m or MARGIN_M,
        "assist": condition.assist,
    }
    return SideValues(robot, {"seed": planned.seed, "link": link, "haptics": condition.haptics, "fixed_task": True})
