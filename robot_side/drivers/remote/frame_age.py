"""Frames of objects that are carried on from the time of their picture to now (docs/drivers.md)."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.surroundings.age import Since, since
from robot_side.surroundings.movers import Movers
from robot_side.surroundings.perceived import PerceivedObjects

_STILL_M_S: Final = 0.002
"""Speed up to which an object counts as at rest"""


class CarriedFrame:
    """Frame whose moving objects are carried on by their velocities, and whose errors grow with its age."""

    def __init__(self, first: PerceivedObjects, taken_s: tuple[float, float], unseen_m_s: float) -> None:
        """first: the frame as it was sent. unseen_m_s: speed at which anything may move unseen."""
        self.taken_s, self._unseen_m_s = taken_s, unseen_m_s
        velocities = np.zeros((len(first.names), 3)) if first.velocities_m_s is None else first.velocities_m_s
        moving = np.flatnonzero(np.einsum("ki,ki->k", velocities, velocities) > _STILL_M_S**2)
        self._velocities_m_s: FloatArray = velocities[moving]
        self._movers = Movers(first, moving)
        self._shown: PerceivedObjects | None = None
        self._shown_since = Since(-math.inf, 0.0, 0.0)

    def at(self, now_s: float) -> PerceivedObjects:
        """Return the frame at `now_s`: the same object until something in it has changed."""
        known, shown = since(self.taken_s, now_s, self._unseen_m_s), self._shown_since
        moves, first = len(self._velocities_m_s) > 0, self._movers.first
        due = moves and known.is_later(shown)
        if self._shown is None or due or known.unseen_m != shown.unseen_m:
            self._shown_since = known
            by_m = known.carried_s * self._velocities_m_s
            late_s = known.late_s if moves else 0.0
            numbers = self._movers.displaced(by_m)
            self._shown = self._movers.frame(first.time_s, numbers, first.roles, known.unseen_m, late_s)
        return self._shown
