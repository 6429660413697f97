"""Look ahead as it is, and as one thing is set otherwise, over the same recorded ticks: costs, and ways apart."""

import math
import time
from collections import deque
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import TriggerField
from feelahead.lab.approaches.ticks import Recorded, with_cover, with_hulls
from robot_side.ahead.law import Sensed, Situation
from robot_side.ahead.looks import Looks
from robot_side.ahead.scene_table import scene_table
from robot_side.ahead.swept_law import SweptLaw
from robot_side.compiled.warm_up import warm_up
from robot_side.settings import RobotSettings

COVER_M: Final = RobotSettings().cover_m
WAYS: Final = tuple(
    f"{side} {kind} {strength}" for side in ("R2", "L2") for kind in ("fast", "slow") for strength in ("first", "full")
)
"""Ways that are compared: where strength begins and is full, of both triggers' fast and slow zones."""
KINDS: Final = ("fast first", "fast full", "slow first", "slow full")
_FULL_SLOW: Final = 3
"""Things to be touched are felt by four of the eight strengths at most."""
_CHUNK: Final = 250


@dataclass(frozen=True)
class Variant:
    """The look ahead, as it is but for what is given here."""

    knob: str = "as it is"
    value: str = ""
    late_ticks: int = 0
    """A look is felt by that many ticks later, shortened by what the tool has moved along since."""
    cover_m: float = COVER_M
    """The gripper's spheres stand out this far: fewer of them for more"""
    hulls: bool = False
    """Meshes count as their convex hulls, each object's as one."""


@dataclass(frozen=True)
class Replayed:
    """One way of looking, over the ticks of one run."""

    took_us: FloatArray
    """(t,) processor time of the law, the least of all times that the tick was gone through"""
    ways_m: FloatArray
    """(t, 8) those of WAYS; the horizon where nothing is felt"""
    horizon_m: FloatArray
    """(t,)"""
    spheres: int
    looks_per_s: float

    def costs(self) -> dict[str, float]:
        """Sum up the costs."""
        p50, p99 = np.quantile(self.took_us, (0.5, 0.99)).tolist()
        times = {"p50_us": p50, "p99_us": p99, "mean_us": float(self.took_us.mean())}
        return {"spheres": self.spheres, "looks_per_s": self.looks_per_s, **times}


def errors_mm(found: Replayed, finest: Replayed, kind: str) -> dict[str, float]:
    """Compare one kind of way of both triggers, in mm: too late is above 0, too early below.

    A tick counts if either feels something; a way that only one of both feels counts up to the horizon.
    """
    columns = [place for place, name in enumerate(WAYS) if name.endswith(kind)]
    horizon = np.minimum(found.horizon_m, finest.horizon_m)[:, None]
    ours, theirs = (np.minimum(one.ways_m[:, columns], horizon) for one in (found, finest))
    apart: FloatArray = 1e3 * (ours - theirs)[np.minimum(ours, theirs) < horizon]
    if not apart.size:
        return {}
    ends = {"earliest": float(apart.min()), "latest": float(apart.max())}
    return {"mean": float(apart.mean()), "p95": float(np.quantile(np.abs(apart), 0.95)), **ends}


def replay(recorded: Recorded, variants: list[Variant], times: int) -> list[Replayed]:
    """Ask each variant the same ticks, in turns of a chunk, `times` times over."""
    warm_up()
    ticks = [with_cover(recorded, one.cover_m) if one.cover_m != COVER_M else recorded.ticks for one in variants]
    ticks = [with_hulls(recorded) if one.hulls else own for one, own in zip(variants, ticks, strict=True)]
    count = len(recorded.ticks)
    took_s, felt = np.full((len(variants), count), math.inf), np.empty((len(variants), count, len(WAYS) + 1))
    looks = np.zeros(len(variants))
    for _ in range(times):
        laws = [LateLaw(recorded.new_law(), variant.late_ticks) for variant in variants]
        for first in range(0, count, _CHUNK):
            for number, (law, own) in enumerate(zip(laws, ticks, strict=True)):
                for place in range(first, min(first + _CHUNK, count)):
                    tick = own[place]
                    # A new frame is taken over equally often, however one looks.
                    scene_table(tick.situation.objects)
                    began_s = time.thread_time()
                    sensed = law.sense(tick.situation, tick.now_s)
                    took_s[number, place] = min(took_s[number, place], time.thread_time() - began_s)
                    felt[number, place] = *_ends(sensed.r2), *_ends(sensed.l2), sensed.horizon_m
        looks[:] = [law.law.ahead.counts.fields for law in laws]
    passed_s = recorded.ticks[-1].now_s - recorded.ticks[0].now_s
    spheres = [len(own[0].situation.pose.sphere_radii_m) for own in ticks]
    return [
        Replayed(1e6 * took_s[k], felt[k, :, :-1], felt[k, :, -1], spheres[k], float(looks[k]) / passed_s)
        for k in range(len(variants))
    ]


def _ends(felt: TriggerField) -> tuple[float, ...]:
    return felt.fast_m[0], felt.fast_m[-1], felt.slow_m[0], felt.slow_m[_FULL_SLOW]


class LateLaw:
    """A law, whose looks become known some ticks later."""

    def __init__(self, law: SweptLaw, late_ticks: int) -> None:
        self.law = law
        self._late = _LateLooks(late_ticks) if late_ticks else None
        if self._late is not None:
            law.turns.looks = self._late

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick."""
        if self._late is not None:
            self._late.tick()
        return self.law.sense(situation, now_s)


class _LateLooks(Looks):
    """Takes looks in some ticks later; the very first look from a place at once."""

    def __init__(self, ticks: int) -> None:
        super().__init__()
        self._ticks, self._now = ticks, 0
        self._waiting: deque[tuple[int, int, int, float, tuple[Any, ...]]] = deque()

    def add(self, side: int, place: int, now_s: float, *seen: Any) -> None:
        """Take a look in, later."""
        if self.looked_s[side][place] < 0.0:
            super().add(side, place, now_s, *seen)
            return
        self.looked_s[side][place] = now_s
        self._waiting.append((self._now + self._ticks, side, place, now_s, seen))

    def tick(self) -> None:
        """Let a tick pass."""
        self._now += 1
        while self._waiting and self._waiting[0][0] <= self._now:
            _, side, place, then_s, seen = self._waiting.popleft()
            if place < len(looked_s := self.looked_s[side]):
                newest_s = looked_s[place]
                super().add(side, place, then_s, *seen)
                looked_s[place] = newest_s
