"""A point of the gripper as an exact function of the joints, for very many joint errors at once."""

import numpy as np

from common.arrays import FloatArray


class Chain:
    """One point carried by n joints, near one configuration, as a product of exponentials (Brockett 1984).

    x = exp(ξ₁ δ₁) ... exp(ξₙ δₙ) p with the joints' screws ξ at that configuration, base to tip: joint i turns whatever
    is beyond it about its axis there, by δᵢ. The screws are the columns of the geometric Jacobian, so that no model of
    the robot is needed besides.
    """

    def __init__(self, jacobian: FloatArray, tool_position_m: FloatArray, point_m: FloatArray) -> None:
        """jacobian (6, n) of the tool's point, linear rows first, base to tip; all in the world frame.

        point_m (3,): the point to follow, anywhere on what the last joint moves.
        """
        self._point_m = point_m
        self._axes = np.ascontiguousarray(jacobian[3:].T)
        self._linear = np.ascontiguousarray(jacobian[:3].T)
        # ω × (p - c) = v with c on the axis: c = p - v × ω, as |ω| = 1.
        self._on_axes_m = tool_position_m - np.cross(self._linear, self._axes)

    def displacements(self, changes_rad: FloatArray) -> FloatArray:
        """Where the point goes, (k, 3) in metres from where it is, as the joints change by (k, n).

        The difference itself is added up: changes of 1e-5 rad keep their digits.
        """
        moved = np.zeros((len(changes_rad), 3))
        for joint in reversed(range(len(self._axes))):
            axis, change = self._axes[joint], changes_rad[:, joint, None]
            if not axis.any():
                moved += change * self._linear[joint]
                continue
            across = np.cross(axis, moved + (self._point_m - self._on_axes_m[joint]))
            moved += np.sin(change) * across + 2.0 * np.sin(0.5 * change) ** 2 * np.cross(axis, across)
        return moved
