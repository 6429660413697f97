"""Frames of the surfaces that were handed on, with their errors and their age."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.depth.slots import SlotChanges, Slots
from robot_side.surroundings.age import STILL, Since, since
from robot_side.surroundings.perceived import PerceivedObjects, UnknownSpace


class SurfaceFrames:
    """Newest surfaces, as the law gets them."""

    def __init__(
        self, slots: int, camera_sd_m: float, unseen_m_s: float, fixed: PerceivedObjects | None = None
    ) -> None:
        """slots: number of surfaces. camera_sd_m: σ_c of calibration and mount. unseen_m_s: as for RemoteObjects.

        fixed: as for Slots.
        """
        self._slots, self._camera_sd_m, self._unseen_m_s = Slots(slots, fixed), camera_sd_m, unseen_m_s
        self._taken_s = (math.inf, math.inf)
        self._frame = self._slots.frame(0.0, self._sds_m())
        self._shown: Since | None = STILL
        """What was known when the frame was made; None: something has changed"""
        self._unknown: UnknownSpace | None = None

    def take(self, changes: SlotChanges, taken_s: tuple[float, float], unknown: UnknownSpace | None = None) -> None:
        """Take surfaces that have changed, and unseen space.

        taken_s: earliest and latest time of the newest picture.
        """
        self._slots.apply(changes)
        self._taken_s, self._shown, self._unknown = taken_s, None, unknown

    def at(self, now_s: float) -> PerceivedObjects:
        """Return the frame at `now_s`: the same object until something in it has changed."""
        known, shown = self._since(now_s), self._shown
        moves = self._slots.moves
        if shown is None or known.unseen_m != shown.unseen_m or (moves and known.is_later(shown)):
            self._shown = known
            self._frame = self._slots.frame(self._taken_s[0], self._sds_m(), known, self._unknown)
        return self._frame

    def _since(self, now_s: float) -> Since:
        known, moved_s = since(self._taken_s, now_s, self._unseen_m_s), self._slots.moved_s
        if not math.isfinite(moved_s):
            return known
        # One camera may be behind, and what moves was seen by another since.
        moved_s += 0.5 * (self._taken_s[1] - self._taken_s[0])
        return known._replace(carried_s=since((moved_s, moved_s), now_s, 0.0).carried_s)

    def _sds_m(self) -> FloatArray:
        """Return σ_c of each slot (k,): of calibration and mount, and of the pixels that made the surface (eq. 1-2)."""
        sds_m: FloatArray = np.hypot(self._camera_sd_m, self._slots.sds_m)
        return sds_m
