"""Result of one tick: numbers in one array, from which messages are made when they are sent."""

from functools import cached_property
from typing import Final

import numpy as np

from common.arrays import FloatArray, require_finite
from common.protocol.messages import OnsetDistances, TriggerField
from robot_side.field.scratch import STRENGTHS

R2, L2, STICK = 0, 1, 2
"""Sides along which a law looks"""
DISPLACEMENT, STIFFNESS, FULL_SPEED, ACCELERATION, NUMBERS_PER_SIDE = (2 * STRENGTHS + k for k in range(5))
"""Indices of a side's numbers, R2 before L2: after eight fast and eight slow onset distances, δ (m), s(δ), v_max, a"""
SPEED, HORIZON, RUMBLE, ENLARGEMENT, OVERLAP, TOOL_SPEED, NUMBERS = (2 * NUMBERS_PER_SIDE + k for k in range(7))
"""Indices after the numbers of R2 and L2; and the count of all numbers"""


class Sensed:
    """Result of one tick."""

    def __init__(self, numbers: FloatArray) -> None:
        """numbers (NUMBERS,): SI units, at the indices above. They must not change later."""
        self.numbers: Final = numbers

    @classmethod
    def of(cls, l2: TriggerField, r2: TriggerField, **others: float) -> "Sensed":
        """Build one from two fields and the properties below, 0 if not given; ValueError for NaN or infinity."""
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
        """Field along L2."""
        return _trigger_field(self.numbers, L2)

    @cached_property
    def r2(self) -> TriggerField:
        """Field along R2."""
        return _trigger_field(self.numbers, R2)

    def stiffness(self, side: int) -> float:
        """s(δ) of R2 or L2, 0 to 1"""
        return float(self.numbers[side * NUMBERS_PER_SIDE + STIFFNESS])

    @property
    def speed_m_s(self) -> float:
        """v along the direction in which R2 advances"""
        return float(self.numbers[SPEED])

    @property
    def horizon_m(self) -> float:
        """Distance that the fields examine"""
        return float(self.numbers[HORIZON])

    @property
    def rumble(self) -> float:
        """Danger where the stick leads, in eighths, 0 to 1"""
        return float(self.numbers[RUMBLE])

    @property
    def enlargement_m(self) -> float:
        """D_incr of eq. 10 along the motion: |v| t_d + D_σ, the largest of the gripper's spheres"""
        return float(self.numbers[ENLARGEMENT])

    @property
    def overlap_m3(self) -> float:
        """Σ V_ij of the enlarged gripper (eq. 11-12)"""
        return float(self.numbers[OVERLAP])

    @property
    def tool_speed_m_s(self) -> float:
        """|v| of the tool's point"""
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
