"""The gripper's drive: a reference that opens and closes at a bounded speed and force, and what it can feel."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.simulation.gripper_travel import GripperTravel

# Beyond this share of the stroke between where the drive would stand freely and where it stands, and below this
# share of the stroke per second, for this long, something stops the fingers.
_BLOCKED_LAG = 0.02
_STANDING_SPEED_1_S = 0.05
_STANDING_TIME_S = 0.05
# Stiff fingers chatter on what they grip: the speed is averaged over this time.
_SPEED_TIME_CONSTANT_S = 0.05
# Fingers this near to each other have closed on nothing.
_CLOSED_OPENING_M = 1e-3


class GripperDrive:
    """A reference between open, 0, and closed, 1, and whether something is held."""

    def __init__(self, travel: GripperTravel, stroke_time_s: float = 0.6) -> None:
        """Start open. `stroke_time_s`: at full speed; 85 mm at 150 mm/s for a Robotiq 2F-85 (its manual)."""
        if not (math.isfinite(stroke_time_s) and stroke_time_s > 0.0):
            raise ValueError(f"stroke_time_s = {stroke_time_s}; valid: finite and above 0")
        self._travel = travel
        self._stroke_time_s = stroke_time_s
        self._stroke = float(travel.lengths[-1] - travel.lengths[0])
        self._closures: FloatArray = (travel.lengths - travel.lengths[0]) / self._stroke
        self._closure = 0.0
        self._speed_1_s = 0.0
        self._reference = 0.0
        self._command = 0.0
        self._valid_until_s = -math.inf
        self._told_to_close = False
        self._standing_s = 0.0

    def command(self, closing: float, valid_until_s: float) -> None:
        """Close (+1) or open (-1) at that share of the full speed until `valid_until_s`; 0 holds.

        ValueError for a value outside [-1, 1] or a time that is not finite: nothing of it is applied.
        """
        if not -1.0 <= closing <= 1.0:
            raise ValueError(f"closing = {closing}; valid: from -1 (open) to +1 (close)")
        if not math.isfinite(valid_until_s):
            raise ValueError(f"valid_until_s = {valid_until_s}; valid: a finite time")
        self._command = closing
        self._valid_until_s = valid_until_s

    def advance(self, time_s: float, step_s: float, length: float, length_speed: float) -> None:
        """Move the reference on by `step_s` from `time_s`; the drive measures its own length and its change per s."""
        travel = self._travel
        self._closure = (float(length) - float(travel.lengths[0])) / self._stroke
        change = float(length_speed) / self._stroke - self._speed_1_s
        self._speed_1_s += change * min(step_s / _SPEED_TIME_CONSTANT_S, 1.0)
        free = float(np.interp(self._closure, self._closures, travel.references))
        moving = self._command if time_s < self._valid_until_s else 0.0
        if moving != 0.0:
            self._told_to_close = moving > 0.0
            moved = self._reference + moving * step_s / self._stroke_time_s
            # The servo's damping holds a moving drive behind its reference without any force on the fingers. Only
            # on the side that it is told to go to may the reference lead, so that a grip is let go at once.
            center = free + travel.lag_s * self._speed_1_s
            lead = math.copysign(travel.force_lead, moving)
            moved = min(max(moved, center + min(lead, 0.0)), center + max(lead, 0.0))
            self._reference = min(max(moved, 0.0), 1.0)

        blocked = self._reference - free > min(_BLOCKED_LAG, 0.5 * travel.force_lead)
        standing = abs(self._speed_1_s) < _STANDING_SPEED_1_S
        self._standing_s = self._standing_s + step_s if blocked and standing and self._told_to_close else 0.0

    @property
    def control(self) -> FloatArray:
        """The actuators' inputs (g,) now."""
        travel = self._travel
        control: FloatArray = travel.open_control + self._reference * (travel.closed_control - travel.open_control)
        return control

    @property
    def opening_m(self) -> float:
        """The free gap between the fingers at the last measured length, metres."""
        return float(np.interp(self._closure, self._closures, self._travel.openings_m))

    @property
    def holding(self) -> bool:
        """Whether the fingers were told to close and something between them has stopped them."""
        return self._standing_s >= _STANDING_TIME_S and self.opening_m > _CLOSED_OPENING_M
