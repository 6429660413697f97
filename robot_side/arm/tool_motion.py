"""Trigger travel and sticks to the tool's motion; the robot side owns this mapping, as stiffness depends on it.

The tool frame is a camera's optical frame: z forward along the approach axis, x right, y down. R2 advances
along +z and L2 retreats; the left stick moves across, the right stick turns the tool about its own point.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta

from common.arrays import FloatArray
from common.limits import check_limits
from common.protocol.messages import MotionCommand, Vector2
from robot_side.compiled.kernel import NUMBER, compiled, input_array

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


def tool_speed_m_s(tool_jacobian: FloatArray, joint_velocities_rad_s: FloatArray) -> float:
    """How fast the tool's point moves when joints (n,) move so; tool_jacobian (6, n), linear rows first."""
    speed_m_s: float = _speed(tool_jacobian, joint_velocities_rad_s)
    return speed_m_s


@compiled(input_array(2), input_array(1), returns=NUMBER)
def _speed(jacobian: FloatArray, velocities: FloatArray) -> float:
    squared = 0.0
    for row in range(3):
        velocity = 0.0
        for joint in range(velocities.size):
            velocity += jacobian[row, joint] * velocities[joint]
        squared += velocity * velocity
    return math.sqrt(squared)


def deflected(lateral: Vector2, tool_rotation: FloatArray) -> tuple[FloatArray, float]:
    """Where the stick leads: the unit vector (3,) in the world frame, and the deflection, 0 to 1; any for 0."""
    right, up = lateral
    deflection = math.hypot(right, up)
    if deflection == 0.0:
        return np.ascontiguousarray(tool_rotation[:, 0]), 0.0
    direction: FloatArray = (right * tool_rotation[:, 0] - up * tool_rotation[:, 1]) / deflection
    return direction, min(deflection, 1.0)
