"""Whether a driver's states can be true of joints with these limits: their velocities, ways, and both together.

All margins are wide, because honest states are late, skipped, noisy and unevenly stamped: an arm is stopped only for
what no such cause explains.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from common.arrays import BoolArray, FloatArray
from robot_side.arm.commanded import LEVER_M
from robot_side.arm.limits import JointLimits

FASTER: Final = 2.0
"""Multiple of a joint's greatest velocity up to which it is believed, as reported and as moved"""
STEP_RAD: Final = 0.1
"""Way beyond this velocity, for noise of readings and unevenness of stamps; at `LEVER_M` where a joint slides"""
LAG_S: Final = 0.1
"""Lag of reported velocities that is believed, for a joint that reverses at its greatest velocity"""
_ALLOWED: Final = 0.3
"""Share of the way by which reported velocities may be wrong"""
_CREEP_RAD_S: Final = 0.05
"""Velocity that may be reported as none"""
_GAP_S: Final = 0.1
"""Time between two states beyond which their velocities say nothing about the way between them"""
_TURN_RAD: Final = 6.0
"""Range from which a joint's readings may wrap by a turn, as in `following.py`"""


class Plausibility:
    """Comparison of each state of a driver with the states before.

    Ways are added up with their signs (cumulative sums). So noise, which comes back, adds nothing, and a way beyond the
    limit counts between any two states.
    """

    def __init__(self, names: Sequence[str], limits: JointLimits, sigma_rad: float = 0.0) -> None:
        """names (n,): the joints'. sigma_rad: standard deviation of a reading."""
        count = len(names)
        slides = np.broadcast_to(limits.slides, count)
        lower_rad, upper_rad = limits.ends_rad
        scale = np.where(slides, LEVER_M, 1.0)
        self._names = [f"joint {j + 1} ({name[:40]})" for j, name in enumerate(names)]
        self._units = ["m" if one else "rad" for one in slides]
        self._turns = np.where(~slides & (upper_rad - lower_rad >= _TURN_RAD), 2.0 * math.pi, math.inf)
        self._limits = limits
        self._step = STEP_RAD * scale + 6.0 * sigma_rad
        self._creep = _CREEP_RAD_S * scale
        self._count = count
        self.read_limits()
        self.restart()

    def read_limits(self) -> None:
        """Judge by the limits as they are now."""
        self._fastest = FASTER * self._limits.velocity_rad_s
        self._apart = LAG_S * self._fastest + self._step
        self._change = 0.5 * self._limits.acceleration_rad_s2

    def restart(self) -> None:
        """Begin anew at the next state, which may be anywhere."""
        self._last: tuple[float, FloatArray, FloatArray | None] | None = None
        self._forget()

    def _forget(self) -> None:
        zeros = (2, self._count)
        self._beyond, self._began_s = np.zeros(zeros), np.full(zeros, math.nan)
        self._off, self._way, self._told = np.zeros(zeros), np.zeros(zeros), np.zeros(zeros)

    def new_clock(self, time_s: float, since_s: float) -> None:
        """Go on with another clock, on which `time_s` is `since_s` after the last state."""
        if self._last is not None:
            self._began_s += time_s - since_s - self._last[0]
            self._last = (time_s - since_s, *self._last[1:])

    def fault(self, time_s: float, positions_rad: FloatArray, velocities_rad_s: FloatArray) -> str | None:
        """Return what cannot be true of a state, in one line; None if nothing. After a fault all begins anew.

        time_s: time of measurement on the driver's clock. positions_rad, velocities_rad_s (n,): finite.
        """
        last, self._last = self._last, (time_s, positions_rad, velocities_rad_s)
        found = self._too_fast(velocities_rad_s)
        if found is None and last is not None:
            since_s = max(time_s - last[0], 0.0)
            moved = positions_rad - last[1]
            with np.errstate(invalid="ignore"):
                moved = np.where(np.isinf(self._turns), moved, moved - self._turns * np.rint(moved / self._turns))
            found = self._too_far(last[0], since_s, moved)
            if found is None and last[2] is not None:
                found = self._apart_from(since_s, moved, 0.5 * since_s * (last[2] + velocities_rad_s))
        if found is not None:
            self._last = time_s, positions_rad, None
            self._forget()
        return found

    def _too_fast(self, velocities: FloatArray) -> str | None:
        j = _worst(np.abs(velocities) > self._fastest)
        if j is None:
            return None
        unit, fastest = self._units[j], self._fastest[j]
        return f"{self._names[j]}: velocity = {velocities[j]:.4g} {unit}/s; valid: up to {fastest:.4g} {unit}/s"

    def _too_far(self, before_s: float, since_s: float, moved: FloatArray) -> str | None:
        """Add up what the joints moved beyond their greatest velocity, in each direction."""
        self._began_s[self._beyond == 0.0] = before_s
        self._beyond = np.maximum(self._beyond + np.stack([moved, -moved]) - self._fastest * since_s, 0.0)
        j = _worst(self._beyond > self._step)
        if j is None:
            return None
        way = int(self._beyond[1, j] > self._beyond[0, j])
        time_s = before_s + since_s - self._began_s[way, j]
        most, unit = self._fastest[j] * time_s + self._step[j], self._units[j]
        far = most - self._step[j] + self._beyond[way, j]
        return f"{self._names[j]}: moved by {far:.4g} {unit} in {1e3 * time_s:.0f} ms; valid: up to {most:.4g} {unit}"

    def _apart_from(self, since_s: float, moved: FloatArray, told: FloatArray) -> str | None:
        """Add up how far the joints' ways are from those that the velocities tell, in each direction."""
        if since_s > _GAP_S:
            self._off[:] = 0.0
            return None
        allowed = _ALLOWED * np.maximum(np.abs(told), np.abs(moved)) + (self._creep + self._change * since_s) * since_s
        rests = self._off == 0.0
        self._way, self._told = np.where(rests, 0.0, self._way) + moved, np.where(rests, 0.0, self._told) + told
        self._off = np.maximum(self._off + np.stack([moved - told, told - moved]) - allowed, 0.0)
        j = _worst(self._off > self._apart)
        if j is None:
            return None
        side, unit = int(self._off[1, j] > self._off[0, j]), self._units[j]
        return (
            f"{self._names[j]}: moved by {self._way[side, j]:.4g} {unit}, but its velocities tell"
            f" {self._told[side, j]:.4g} {unit}; valid: at most {self._apart[j]:.4g} {unit} apart, and 30 %"
        )


def _worst(wrong: BoolArray) -> int | None:
    """Return the first joint that is wrong in an array (n,) or (2, n); None if none is."""
    found = np.flatnonzero(wrong.any(axis=0) if wrong.ndim > 1 else wrong)
    return int(found[0]) if found.size else None
