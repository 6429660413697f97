"""Frames in which an operator may steer: how far the sticks' plane is turned from the tool's to another frame's.

The sticks always move and turn the tool across its approach axis, along which the triggers move it. So a frame is
tilted onto the approach axis, by the shortest way; what remains between its right and the tool's is one angle.
"""

import math
from dataclasses import dataclass
from typing import Final

from common.arrays import FloatArray

_FACES: Final = -0.5
"""Cosine of the angle between approach axis and line of sight from which the tool faces the camera: 120°"""


@dataclass(frozen=True)
class Frame:
    """Axes of a frame in the world: (3,) unit vectors, orthogonal to each other."""

    right: FloatArray
    up: FloatArray
    ahead: FloatArray

    def faces(self, tool_rotation: FloatArray) -> bool:
        """Return whether the tool (3, 3) points against `ahead`, so that its right is the frame's left."""
        return bool(self.ahead @ tool_rotation[:, 2] < _FACES)

    def turn_rad(self, tool_rotation: FloatArray, *, mirrored: bool = False) -> float:
        """Return the angle from the tool's right to the frame's, positive towards the tool's up, from -π to π.

        It is the best fit of the frame's right and up, as projected across the approach axis. mirrored: up lies
        clockwise of right, as for a tool that faces its viewer.
        """
        x, y = tool_rotation[:, 0], -tool_rotation[:, 1]
        across, sign = (float(self.right @ x), float(self.right @ y)), -1.0 if mirrored else 1.0
        upward = float(self.up @ x), float(self.up @ y)
        return math.atan2(across[1] - sign * upward[0], across[0] + sign * upward[1])


@dataclass(frozen=True)
class StickFrames:
    """The two frames besides the tool's own."""

    base: Frame
    """Ahead from the base to where the tool starts, horizontally; up in the world"""
    camera: Frame
    """Right and up in the picture of the overview"""
