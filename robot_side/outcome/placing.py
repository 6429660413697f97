"""Result of placing a lifted target: when, where, how fast, and whether a warning was felt before the contact."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from common.arrays import FloatArray

if TYPE_CHECKING:
    from robot_side.tick.truth import TargetTruth

LIFTED_M: Final = 0.01
"""Distance from every support, in m, at which the target counts as lifted."""
STANDING_M: Final = 0.001
UPRIGHT_RAD: Final = math.radians(10.0)
_SAME_WARNING_S: Final = 0.5
"""Time, in seconds, within which a repeated warning counts as the same warning."""


class Placing:
    """Observer of the true target from its grasp until it stands by itself."""

    def __init__(self) -> None:
        self.placed = False
        self.placed_s: float | None = None
        self.contact_speed_m_s: float | None = None
        self.felt_s: float | None = None
        """Time from the start of the last warning to the contact with the support"""
        self.felt_m: float | None = None
        """Distance to the support at the start of that warning"""
        self._lifted = False
        self._touched = False
        self._before: TargetTruth | None = None
        self._stood_m: FloatArray | None = None
        self._warned: tuple[float, float] | None = None
        """Start of the present warning, and the distance to the support at that time"""
        self._warned_last_s = -math.inf

    def observe(self, target: TargetTruth, held: bool, warned: bool, now_s: float) -> None:
        """Take the target's truth at `now_s`. warned: whether rumble or a trigger's stiffness was above 0."""
        if self._stood_m is None:
            self._stood_m = target.position_m
        if now_s - self._warned_last_s > _SAME_WARNING_S:
            self._warned = None
        if warned:
            self._warned_last_s = now_s
            self._warned = self._warned or (now_s, target.support_gap_m)
        if target.support_gap_m > LIFTED_M:
            # A target that falls out of the fingers is never placed, even if it stands.
            self._lifted, self._touched = held, False
        if self._lifted and not self._touched and target.support_gap_m <= 0.0:
            self._touched = True
            self.contact_speed_m_s = (self._before or target).sinking_m_s
            self.felt_s = self.felt_m = None
            if self._warned is not None:
                self.felt_s, self.felt_m = now_s - self._warned[0], self._warned[1]
        stands = target.support_gap_m <= STANDING_M and target.tilt_rad <= UPRIGHT_RAD
        self.placed = self._touched and not held and stands
        if not self.placed:
            self.placed_s = None
        elif self.placed_s is None:
            self.placed_s = now_s
        self._before = target

    def summary(self, began_s: float | None) -> dict[str, Any]:
        """Return the summary's entry `placing`; its times count from `began_s`."""
        known = None if self.placed_s is None or began_s is None else self.placed_s - began_s
        now = self._before
        moved_m = None
        if now is not None and self._stood_m is not None:
            moved_m = float(np.linalg.norm((now.position_m - self._stood_m)[:2]))
        return {
            "placed": self.placed,
            "time_s": known,
            "contact_speed_mm_s": scaled(self.contact_speed_m_s, 1e3),
            "felt_before_s": self.felt_s,
            "felt_before_mm": scaled(self.felt_m, 1e3),
            "off_support_mm": None if now is None else 1e3 * now.support_gap_m,
            "tilt_deg": None if now is None else math.degrees(now.tilt_rad),
            "moved_mm": scaled(moved_m, 1e3),
        }


def scaled(value: float | None, factor: float) -> float | None:
    """Return `value` in another unit; None for None."""
    return None if value is None else value * factor
