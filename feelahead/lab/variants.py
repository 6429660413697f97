"""Run the law over the same recorded ticks with fewer or more spheres: its run time, and errors of onset distances."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import TriggerField
from feelahead.lab.approaches.ticks import Recorded, with_cover
from robot_side.compiled.warm_up import warm_up
from robot_side.settings import RobotSettings

COVER_M: Final = RobotSettings().cover_m
COVERS_M: Final = (0.015, 0.008, 0.005, COVER_M, 0.0015, 0.001)
"""Tried covers, by how far spheres may protrude from the gripper, in metres. The last cover is the finest."""
WAYS: Final = tuple(
    f"{side} {kind} {strength}" for side in ("R2", "L2") for kind in ("fast", "slow") for strength in ("first", "full")
)
"""Compared onset distances: of the first strength and of full strength, in both triggers' fast and slow lists."""
KINDS: Final = ("fast first", "fast full", "slow first", "slow full")
_FULL_SLOW: Final = 3
"""Index, in the slow list, of the greatest strength of objects to be touched: the fourth of eight."""
_CHUNK: Final = 250


@dataclass(frozen=True)
class Replayed:
    """Results of the law with one cover, over all ticks of one run."""

    took_us: FloatArray
    """(t,) processor time of the law in each tick, in µs: the least of all passes"""
    onsets_m: FloatArray
    """(t, 8) onset distances named by WAYS; the horizon where nothing is felt"""
    horizon_m: FloatArray
    """(t,) distance ahead that the looks examined"""
    spheres: int
    looks_per_s: float

    def costs(self) -> dict[str, float]:
        """Return the number of spheres, looks a second, and quantiles of the law's time as a row."""
        p50, p99 = np.quantile(self.took_us, (0.5, 0.99)).tolist()
        times = {"p50_us": p50, "p99_us": p99, "mean_us": float(self.took_us.mean())}
        return {"spheres": self.spheres, "looks_per_s": self.looks_per_s, **times}


def errors_mm(found: Replayed, finest: Replayed, kind: str) -> dict[str, float]:
    """Compare the onset distances of one kind, of both triggers, with those of the finest cover, in mm.

    Above 0 the distance is too late, below 0 too early. A tick counts if something is felt with either cover. Where it
    is felt with one cover only, the other's distance counts as the horizon.
    """
    columns = [place for place, name in enumerate(WAYS) if name.endswith(kind)]
    horizon = np.minimum(found.horizon_m, finest.horizon_m)[:, None]
    ours, theirs = (np.minimum(one.onsets_m[:, columns], horizon) for one in (found, finest))
    apart: FloatArray = 1e3 * (ours - theirs)[np.minimum(ours, theirs) < horizon]
    if not apart.size:
        return {}
    ends = {"earliest": float(apart.min()), "latest": float(apart.max())}
    return {"mean": float(apart.mean()), "p95": float(np.quantile(np.abs(apart), 0.95)), **ends}


def replay(recorded: Recorded, covers_m: Sequence[float], times: int) -> list[Replayed]:
    """Run the law `times` times over the same ticks with each cover; covers take turns after each chunk of ticks."""
    warm_up()
    ticks = [with_cover(recorded, cover_m) if cover_m != COVER_M else recorded.ticks for cover_m in covers_m]
    count = len(recorded.ticks)
    took_s, felt = np.full((len(ticks), count), math.inf), np.empty((len(ticks), count, len(WAYS) + 1))
    for _ in range(times):
        laws = [recorded.new_law() for _ in ticks]
        for first in range(0, count, _CHUNK):
            for number, (law, own) in enumerate(zip(laws, ticks, strict=True)):
                for place, tick in enumerate(own[first : first + _CHUNK], first):
                    # Reading the frame is not measured, as it is the same work for each cover.
                    law.surroundings.see(tick.situation.objects)
                    began_s = time.thread_time()
                    sensed = law.sense(tick.situation, tick.now_s)
                    took_s[number, place] = min(took_s[number, place], time.thread_time() - began_s)
                    felt[number, place] = *_ends(sensed.r2), *_ends(sensed.l2), sensed.horizon_m
    passed_s = recorded.ticks[-1].now_s - recorded.ticks[0].now_s
    return [
        Replayed(
            took_us=1e6 * took_s[number],
            onsets_m=felt[number, :, :-1],
            horizon_m=felt[number, :, -1],
            spheres=len(own[0].situation.pose.sphere_radii_m),
            looks_per_s=law.summary()["fields"] / passed_s,
        )
        for number, (law, own) in enumerate(zip(laws, ticks, strict=True))
    ]


def _ends(felt: TriggerField) -> tuple[float, ...]:
    return felt.fast_m[0], felt.fast_m[-1], felt.slow_m[0], felt.slow_m[_FULL_SLOW]
