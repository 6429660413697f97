"""Result of one tick of the law: numbers in one array. Messages are made from it only when they are sent."""

from functools import cached_property
from typing import Final

import numpy as np

from common.arrays import FloatArray, require_finite
from common.protocol.messages import OnsetDistances, TriggerField
from common.protocol.uniform_field import STRENGTHS

R2, L2, STICK = 0, 1, 2
"""Numbers of the sides along which a law looks: the directions of both triggers and of the deflected stick"""
DISPLACEMENT, STIFFNESS, FULL_SPEED, ACCELERATION, NUMBERS_PER_SIDE = (2 * STRENGTHS + k for k in range(5))
"""Indices within one side's numbers: eight fast and eight slow onset distances come first, then δ (m), s(δ), v_max
(m/s), a (m/s²). R2's numbers come before L2's."""
SPEED, HORIZON, RUMBLE, ENLARGEMENT, OVERLAP, TOOL_SPEED, NUMBERS = (2 * NUMBERS_PER_SIDE + k for k in range(7))
"""Indices of the numbers that follow those of R2 and L2; NUMBERS is the count of all"""


class Sensed:
    """Result of one tick of the law: a field along each trigger, the rumble, and figures for display."""

    def __init__(self, numbers: FloatArray) -> None:
        """numbers (NUMBERS,): SI units, at the indices above. They must not change later."""
        self.numbers: Final = numbers

    @classmethod
    def of(cls, l2: TriggerField, r2: TriggerField, **others: float) -> "Sensed":
        """Build a result from two fields and any of the properties below by name; those not given are 0.

        ValueError for a property that is NaN or infinite.
        """
        numbers: FloatArray = np.zeros(NUMBERS)
        for side, field in ((R2, r2), (L2, l2)):
            numbers[side * NUMBERS_PER_SIDE : (side + 1) * NUMBERS_PER_SIDE] = (
                *(*field.fast_m, *field.slow_m, field.displacement_m, field.stiffness),
                *(field.full_speed_m_s, field.acceleration_m_s2),
            )
        for name, value in others.items():
            require_finite(name, np.array([value]))
            numbers[_PLACES[name]] = value
        return cls(numbers)

    @cached_property
    def l2(self) -> TriggerField:
        """Field for L2: onset distances along its direction, with displacement, stiffness and speeds"""
        return _trigger_field(self.numbers, L2)

    @cached_property
    def r2(self) -> TriggerField:
        """Field for R2: onset distances along its direction, with displacement, stiffness and speeds"""
        return _trigger_field(self.numbers, R2)

    def stiffness(self, side: int) -> float:
        """Return s(δ), 0 to 1, of one side: R2 or L2."""
        return float(self.numbers[side * NUMBERS_PER_SIDE + STIFFNESS])

    @property
    def speed_m_s(self) -> float:
        """Tool's speed along the direction in which R2 advances; negative while it retreats"""
        return float(self.numbers[SPEED])

    @property
    def horizon_m(self) -> float:
        """Distance ahead that is known; both triggers' onset distances are cut to it"""
        return float(self.numbers[HORIZON])

    @property
    def rumble(self) -> float:
        """Rumble, 0 to 1 in eighths: the share of strengths that begin within the stopping distance along the stick"""
        return float(self.numbers[RUMBLE])

    @property
    def enlargement_m(self) -> float:
        """D_incr of eq. 10 along the motion, |v| t_d + D_σ; for the sphere with the largest"""
        return float(self.numbers[ENLARGEMENT])

    @property
    def overlap_m3(self) -> float:
        """Total overlap Σ V_ij of the enlarged gripper with all objects (eq. 11-12)"""
        return float(self.numbers[OVERLAP])

    @property
    def tool_speed_m_s(self) -> float:
        """Speed |v| of the tool's point in any direction"""
        return float(self.numbers[TOOL_SPEED])


_PLACES: Final = {
    "speed_m_s": SPEED,
    "horizon_m": HORIZON,
    "rumble": RUMBLE,
    "enlargement_m": ENLARGEMENT,
    "overlap_m3": OVERLAP,
    "tool_speed_m_s": TOOL_SPEED,
}


def _trigger_field(numbers: FloatArray, side: int) -> TriggerField:
    mine = numbers[side * NUMBERS_PER_SIDE : (side + 1) * NUMBERS_PER_SIDE].tolist()
    return TriggerField(
        fast_m=_eight(mine, 0),
        slow_m=_eight(mine, STRENGTHS),
        full_speed_m_s=mine[FULL_SPEED],
        acceleration_m_s2=mine[ACCELERATION],
        displacement_m=mine[DISPLACEMENT],
        stiffness=mine[STIFFNESS],
    )


def _eight(numbers: list[float], first: int) -> OnsetDistances:
    one, two, three, four, five, six, seven, eight = numbers[first : first + STRENGTHS]
    return one, two, three, four, five, six, seven, eight
