"""Space around the gripper that no camera has seen."""

from dataclasses import dataclass, field

import numpy as np

from common.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class UnknownSpace:
    """Shares, 0 to 1, of the space on each side of the gripper that nobody has seen, and where it counts."""

    ahead: float
    left: float
    right: float
    up: float
    down: float
    boxes_m: FloatArray = field(default_factory=lambda: np.empty((0, 2, 3)))
    """(u, 2, 3) lower and upper corners, in the world frame, of boxes of at most half strength, which share no space;
    none if unknown space is free"""

    @property
    def shares(self) -> tuple[float, float, float, float, float]:
        """Shares ahead, left, right, up and down"""
        return self.ahead, self.left, self.right, self.up, self.down
