"""Map from trigger travel and sticks to the tool's motion.

The map is on the robot side, because the stiffness depends on it. The tool frame is as a camera's optical frame: z
forward along the approach axis, x right, y down. R2 advances along +z and L2 retreats. The left stick moves the tool
sideways; the right stick turns the tool about its origin.
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
    """Speeds of the tool at full travel of a trigger and at full deflection of a stick."""

    trigger_speed_m_s: _Speed = 0.25
    """Speed at full travel of a trigger; the default is ISO 10218's reduced speed for an arm near people."""
    stick_speed_m_s: _Speed = 0.1
    turn_speed_rad_s: _Speed = 0.5

    def __post_init__(self) -> None:
        check_limits(self)


def tool_motion(command: MotionCommand, settings: ToolMotionSettings) -> tuple[Vector3, Vector3]:
    """Return the tool's commanded linear and angular velocity, each (3,) in the tool frame, in m/s and rad/s."""
    right, up = command.lateral
    turn_right, turn_up = command.turning
    across, turn = settings.stick_speed_m_s, settings.turn_speed_rad_s
    # Looking right is a rotation about y, which points down; looking up, about x.
    return (
        (across * right, -across * up, settings.trigger_speed_m_s * (command.r2 - command.l2)),
        (turn * turn_up, turn * turn_right, 0.0),
    )


def full_twists(settings: ToolMotionSettings) -> FloatArray:
    """Return the tool's twists (5, 6), linear part first, at full travel of R2 and at each full stick deflection."""
    travel, across, turn = settings.trigger_speed_m_s, settings.stick_speed_m_s, settings.turn_speed_rad_s
    twists = np.zeros((5, 6))
    twists[0, 2], twists[1, 0], twists[2, 1], twists[3, 4], twists[4, 3] = travel, across, -across, turn, turn
    return twists
