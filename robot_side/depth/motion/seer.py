"""What moves in the pictures of several cameras: found again from picture to picture, with a velocity."""

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.depth.motion.fitting import Fit, fit_motion, note_members
from robot_side.depth.motion.regions import LabelsArray, moved_regions
from robot_side.depth.motion.snapshots import Earlier, Snapshot
from robot_side.depth.picture import DepthErrors

_AGES_S: Final = (0.3, 0.2, 0.1)
"""Ages of earlier pictures to compare with: the slower, the older"""
_STEP_M: Final = 0.02
"""Displacement at which what is known to move is compared with its earlier picture"""
_CONFIRMED: Final = 2
"""Pictures after which motion counts"""
UNSEEN_S: Final = 0.25
"""Time without a picture that shows motion after which it has ended"""
_NEWER: Final = 0.5
"""Share of the newest picture in a velocity"""
_FASTER: Final = 1.25
"""Factor from which on a speed is taken for a new one: what has just begun to move was at rest for part of the time"""
_NEAR_M: Final = 0.04
_ALIKE: Final = 0.6
"""How far, beyond its own reach, a thing may be found from where it is expected, and by which share of its speed its
velocity may differ"""
_SLOW_M_S: Final = 0.03
_TURN: Final = 0.01
_PLACE_M: Final = 0.006
_SIGMAS: Final = 3.0
"""Error of a mount, in rad and in m, that makes things seem to move while their camera does; standard deviations"""
_LEAST_ALIKE: Final = 9.0
"""Least number of pixels whose errors count as one: normals and support are of neighbours, whatever a camera says"""
_OF_CAMERA: Final = 256


@dataclass
class Mover:
    """Thing that moves, as one camera sees it."""

    identity: int
    velocity_m_s: FloatArray
    center_m: FloatArray
    reach_m: float
    seen_s: float
    pictures: int = 1

    @property
    def counts(self) -> bool:
        """Whether pictures enough have shown its motion"""
        return self.pictures >= _CONFIRMED

    def is_at(self, fit: Fit, velocity_m_s: FloatArray, now_s: float) -> bool:
        """Return whether a region with this velocity is this thing."""
        there_m = self.center_m + (now_s - self.seen_s) * self.velocity_m_s
        apart_m_s, *speeds_m_s = (
            float(np.linalg.norm(one)) for one in (velocity_m_s - self.velocity_m_s, velocity_m_s, self.velocity_m_s)
        )
        near = float(np.linalg.norm(fit.center_m - there_m)) <= self.reach_m + fit.reach_m + _NEAR_M
        return near and apart_m_s <= _SLOW_M_S + _ALIKE * max(speeds_m_s)


class MotionSeer:
    """Finds what moves."""

    def __init__(self) -> None:
        self._earlier: defaultdict[int, Earlier] = defaultdict(Earlier)
        self._numbers = itertools.count(1)
        self.movers: dict[int, Mover] = {}
        """All that moves, by identity"""

    def of_camera(self, camera: int) -> IntArray:
        """Return the identities (n,) of what moves in a camera's pictures."""
        return np.array([one for one in self.movers if one % _OF_CAMERA == camera], dtype=np.int64)

    def end_unseen(self, now_s: float) -> None:
        """Forget what no picture has shown to move for too long, also of a camera that sends no more."""
        for identity in [one for one, mover in self.movers.items() if now_s - mover.seen_s > UNSEEN_S]:
            del self.movers[identity]

    def noise(self, camera: int) -> float:
        """Return the factor on the variance of a camera's errors by which standing things differ in its pictures."""
        return self._earlier[camera].noise

    def see(self, newest: Snapshot, errors: DepthErrors, camera: int) -> LabelsArray | None:
        """Return the identity of the mover that each pixel (h, w) shows, 0 for none; None if nothing moves.

        camera: number of the one that took it.
        """
        now_s, movers = newest.taken_s, self.movers
        earlier = self._earlier[camera]
        pixels_alike = max(_LEAST_ALIKE, (2.0 * errors.correlation * float(newest.view[0])) ** 2)
        mine = set(self.of_camera(camera).tolist())
        members: LabelsArray = np.zeros(newest.depth_m.shape, dtype=np.int32)
        found: set[int] = set()
        for before, oldest in _to_compare(earlier, newest, [movers[one] for one in mine]):
            since_s, slack = now_s - before.taken_s, _seeming(newest, before)
            regions = moved_regions(newest, before, slack, pixels_alike)
            earlier.measure(regions.noise)
            for region in range(1, regions.number + 1):
                if members[regions.labels == region].any():
                    continue  # a faster thing, as a newer picture has shown
                expected = [np.zeros(3), *(since_s * movers[one].velocity_m_s for one in mine)]
                tries = (fit_motion(newest, before, regions, region, slack, pixels_alike, one) for one in expected)
                fit = next((one for one in tries if one is not None), None)
                if fit is None:
                    continue
                velocity_m_s = fit.moved_m / since_s
                later = earlier.of_age(now_s, 0.5 * since_s, newest)
                if later is not None and later is not before and not fit.slid:
                    lately_s = now_s - later.taken_s
                    start_m = lately_s * velocity_m_s
                    sooner = fit_motion(newest, later, regions, region, _seeming(newest, later), pixels_alike, start_m)
                    faster = _FASTER * float(np.linalg.norm(velocity_m_s))
                    if sooner is not None and float(np.linalg.norm(sooner.moved_m)) > faster * lately_s:
                        velocity_m_s = sooner.moved_m / lately_s
                identity = self._update(fit, velocity_m_s, now_s, mine, found, camera)
                note_members(newest, before, regions, region, slack, fit.moved_m, identity, members)
            # What moves is elsewhere than in the oldest picture.
            if oldest and regions.number == 0:
                break
        for identity in mine - found:
            if not movers[identity].counts:
                del movers[identity]
        earlier.add(newest)
        members[~np.isin(members, [one for one, mover in movers.items() if mover.counts])] = 0
        return members if members.any() else None

    def _update(
        self, fit: Fit, velocity_m_s: FloatArray, now_s: float, mine: set[int], found: set[int], camera: int
    ) -> int:
        """Let a region be a mover that is known, or a new one; return its identity."""
        for identity in mine:
            mover = self.movers[identity]
            if mover.is_at(fit, velocity_m_s, now_s):
                if identity not in found:
                    faster = np.linalg.norm(velocity_m_s) > _FASTER * np.linalg.norm(mover.velocity_m_s)
                    share = 1.0 if faster else _NEWER
                    mover.velocity_m_s = mover.velocity_m_s + share * (velocity_m_s - mover.velocity_m_s)
                    mover.center_m, mover.reach_m, mover.seen_s = fit.center_m, fit.reach_m, now_s
                    mover.pictures += 1
                    found.add(identity)
                return identity
        identity = next(self._numbers) * _OF_CAMERA + camera
        self.movers[identity] = Mover(identity, velocity_m_s, fit.center_m, fit.reach_m, now_s)
        mine.add(identity)
        found.add(identity)
        return identity


def _to_compare(earlier: Earlier, newest: Snapshot, movers: list[Mover]) -> Iterator[tuple[Snapshot, bool]]:
    """Yield the earlier pictures to compare with, and whether each is the oldest: that for the fastest thing first."""
    speed_m_s = max((float(np.linalg.norm(one.velocity_m_s)) for one in movers), default=0.0)
    ages_s = (*((min(_STEP_M / speed_m_s, _AGES_S[0]),) if speed_m_s > 0.0 else ()), *_AGES_S)
    given: list[Snapshot] = []
    for age_s in ages_s:
        before = earlier.of_age(newest.taken_s, age_s, newest)
        if before is not None and not any(before is one for one in given):
            given.append(before)
            yield before, age_s == _AGES_S[0]


def _seeming(newest: Snapshot, before: Snapshot) -> tuple[float, float]:
    """Return how far the camera's own motion may seem to move things, as its mount is not known well.

    In m, and in m for each m of depth.
    """
    moved_m = float(np.linalg.norm(newest.pose.position_m - before.pose.position_m))
    cosine = 0.5 * (float(np.einsum("ij,ij->", newest.pose.rotation, before.pose.rotation)) - 1.0)
    turned = math.acos(min(max(cosine, -1.0), 1.0))
    return _SIGMAS * (_TURN * moved_m + _PLACE_M * turned), _SIGMAS * _TURN * turned
