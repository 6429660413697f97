"""Trigger travel and sticks to the tool's motion; the robot side owns this mapping, as stiffness depends on it.

The tool frame is a camera's optical frame: z forward along the approach axis, x right, y down. R2 advances
along +z and L2 retreats; the left stick moves across, the right stick turns the tool about its own point.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta

from common.arrays import FloatArray
from common.limits import check_limits
from common.protocol.messages import MotionCommand

Vector3 = tuple[float, float, float]
_Speed = Annotated[float, Meta(gt=0.0, le=5.0)]


@dataclass(frozen=True)
class ToolMotionSettings:
    """What full travel and full deflection mean."""

    trigger_speed_m_s: _Speed = 0.25
    """ISO 10218's reduced speed for an arm near people."""
    stick_speed_m_s: _Speed = 0.1
    turn_speed_rad_s: _Speed = 0.5

    def __post_init__(self) -> None:
        check_limits(self)


def tool_motion(command: MotionCommand, settings: ToolMotionSettings) -> tuple[Vector3, Vector3]:
    """The commanded velocity of the tool and its angular velocity, each (3,) in the tool frame, in m/s and rad/s."""
    right, up = command.lateral
    turn_right, turn_up = command.turning
    across, turn = settings.stick_speed_m_s, settings.turn_speed_rad_s
    # To look right is a turn about y, which points down; to look up, one about x.
    return (
        (across * right, -across * up, settings.trigger_speed_m_s * (command.r2 - command.l2)),
        (turn * turn_up, turn * turn_right, 0.0),
    )


def full_twists(settings: ToolMotionSettings) -> FloatArray:
    """Lay out the tool's twists (5, 6), linear part first, of full travel of R2 and of each fully deflected stick."""
    travel, across, turn = settings.trigger_speed_m_s, settings.stick_speed_m_s, settings.turn_speed_rad_s
    twists = np.zeros((5, 6))
    twists[0, 2], twists[1, 0], twists[2, 1], twists[3, 4], twists[4, 3] = travel, across, -across, turn, turn
    return twists
