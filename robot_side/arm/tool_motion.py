"""Trigger travel and sticks to the tool's motion; the robot side owns this mapping, as stiffness depends on it.

The tool frame is a camera's optical frame: z forward along the approach axis, x right, y down. R2 advances
along +z and L2 retreats; the left stick moves across, the right stick turns the tool about its own point.
"""

import math
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import MotionCommand, Vector2


@dataclass(frozen=True)
class ToolMotionSettings:
    """What full travel and full deflection mean."""

    trigger_speed_m_s: float = 0.25
    """ISO 10218's reduced speed for an arm near people."""
    stick_speed_m_s: float = 0.1
    turn_speed_rad_s: float = 0.5

    def __post_init__(self) -> None:
        for name in ("trigger_speed_m_s", "stick_speed_m_s", "turn_speed_rad_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0.0 < value <= 5.0):
                raise ValueError(f"{name} = {value}; valid: above 0 up to 5")


def tool_twist(command: MotionCommand, tool_rotation: FloatArray, settings: ToolMotionSettings) -> FloatArray:
    """The commanded velocity of the tool, (6,) in m/s and rad/s, linear first, in the world frame.

    `tool_rotation` (3, 3) takes the tool frame to the world. ValueError when it is not finite.
    """
    if not np.isfinite(tool_rotation).all():
        raise ValueError("tool_rotation holds a value that is not finite; valid: a rotation matrix")
    right, up = command.lateral
    linear = np.array(
        [
            settings.stick_speed_m_s * right,
            -settings.stick_speed_m_s * up,
            settings.trigger_speed_m_s * (command.r2 - command.l2),
        ]
    )
    turn_right, turn_up = command.turning
    # To look right is a turn about y, which points down; to look up, one about x.
    angular = settings.turn_speed_rad_s * np.array([turn_up, turn_right, 0.0])
    return np.concatenate([tool_rotation @ linear, tool_rotation @ angular])


def deflected(lateral: Vector2, tool_rotation: FloatArray) -> tuple[FloatArray, float]:
    """Where the stick leads: the unit vector (3,) in the world frame, and the deflection, 0 to 1; any for 0."""
    right, up = lateral
    deflection = math.hypot(right, up)
    if deflection == 0.0:
        return np.ascontiguousarray(tool_rotation[:, 0]), 0.0
    direction: FloatArray = (right * tool_rotation[:, 0] - up * tool_rotation[:, 1]) / deflection
    return direction, min(deflection, 1.0)
