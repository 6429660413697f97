"""What does the look ahead cost, and how well is it felt, as it is set otherwise?

feelahead bench felt --quick --picture felt.png
feelahead bench felt --equality
"""

import math
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.table import Table as Shown

from common.arrays import FloatArray
from common.protocol.messages import TriggerField
from feelahead.lab.approaches.ticks import DEMO, Recorded, record, with_cover, with_hulls
from feelahead.lab.figures import figure
from feelahead.lab.goals import Goal
from feelahead.lab.reference.beside import compare_ticks
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
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
_OF_MESHES: Final = ("mug", "u_mesh")
_CHUNK: Final = 250
_LIMIT_M: Final = 1e-12
_LEAST_MM: Final = 1e-3
"""Errors below are drawn here: the axis is logarithmic."""


@dataclass(frozen=True)
class FeltSweep(Sweep):
    """Run time against error of what is felt: how late a look is known, how many spheres cover the gripper, and meshes
    as their convex hulls. Every setting is asked the same recorded ticks, in turns.
    """

    equality: bool = False
    """Instead: the demo's 10 000 ticks by the compiled law and by plain NumPy; how far the two are apart."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.equality and self.picture is not None:
            raise ValueError(f"--picture {self.picture}: --equality has no figure; valid: without --equality")


@dataclass(frozen=True)
class Run:
    """One recorded run: the demo, or a pull of 2 N in a frozen scene."""

    run: str
    duration_s: float
    equality: bool = False
    times: int = 2
    """Each tick is gone through this often; the least time counts."""


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


LADDERS: Final = {
    "a look is late": [Variant("a look is late", f"by {ticks} ms", late_ticks=ticks) for ticks in (10, 4, 2, 1, 0)],
    "spheres stand out": [
        Variant("spheres stand out", f"{1e3 * cover_m:g} mm", cover_m=cover_m)
        for cover_m in (0.015, 0.008, 0.005, COVER_M, 0.0015, 0.001)
    ],
    "objects of meshes": [
        Variant("objects of meshes", "as hulls", hulls=True),
        Variant("objects of meshes", "as meshes"),
    ],
}
"""One thing is set otherwise at a time; each is compared with the finest of the same ladder, the last."""


def cells(settings: FeltSweep) -> Iterator[Run]:
    """Lay out the recorded runs."""
    if settings.equality:
        yield Run(DEMO, 3.0 if settings.quick else 10.0, equality=True)
        return
    yield Run(DEMO, 3.0 if settings.quick else 7.0)
    for scene in ("mug",) if settings.quick else ("wall", "mug", "u_mesh"):
        yield Run(scene, 3.0 if settings.quick else 3.5)


def run(cell: Run, seed: int) -> Iterator[Row]:
    """Record one run, and ask each setting its ticks: a row for each setting."""
    recorded = record(cell.run, cell.duration_s, seed)
    if cell.equality:
        found = compare_ticks(recorded.new_law(), recorded.ticks, recorded.settings.motion)
        for name, largest in found.largest.items():
            yield {"what": name, "largest": largest, "ticks": found.ticks, "looks": found.looks, "ways": found.ways}
        return
    ladders = [rung for rung in LADDERS.values() if not rung[0].hulls or cell.run in _OF_MESHES]
    replayed = iter(replay(recorded, [variant for rung in ladders for variant in rung], cell.times))
    for rung in ladders:
        of_rung = [next(replayed) for _ in rung]
        for variant, one in zip(rung, of_rung, strict=True):
            as_it_is = Variant(variant.knob, variant.value) == variant
            row = {"knob": variant.knob, "value": f"{variant.value}{' (as it is)' if as_it_is else ''}"}
            yield (
                row
                | one.costs()
                | {f"{kind} {name}": size for kind in KINDS for name, size in errors_mm(one, of_rung[-1], kind).items()}
            )


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


def show(_: FeltSweep, table: Table) -> Iterator[Shown | str]:
    """Make a table for each run: a row for each setting; or one of the largest differences."""
    costs = ("spheres", "looks_per_s", "p50_us", "p99_us", "mean_us")
    for (name,), rows in table.groups("run"):
        if (ticks := rows.values("ticks")) != []:
            title = f"compiled beside plain: {ticks[0]} ticks, {rows.values('looks')[0]} looks"
            yield shown(title, ("what", "largest difference"), ((row["what"], row["largest"]) for row in rows))
            continue
        yield shown(
            f"{name}: processor time of the law in a tick; mm: mean, 95 % of the size, earliest to latest",
            ("setting", *costs, *KINDS),
            (
                (
                    f"{row['knob']} {row['value']}",
                    *(row[cost] for cost in costs),
                    *(_apart(row, kind) for kind in KINDS),
                )
                for row in rows
            ),
        )


def _apart(row: Row, kind: str) -> str | None:
    mean, p95, earliest, latest = (row.get(f"{kind} {name}") for name in ("mean", "p95", "earliest", "latest"))
    return None if mean is None else f"{mean:+.2f}; {p95:.2f}; {earliest:+.1f} to {latest:+.1f}"


def goals(settings: FeltSweep, table: Table) -> Iterator[Goal]:
    """Hold the compiled law to the plain one."""
    if settings.equality:
        yield Goal("largest difference of compiled and plain, SI units", max(table.values("largest")), _LIMIT_M)


def draw(_: FeltSweep, table: Table, path: Path) -> None:
    """Draw run time against error of full strength, a line for each thing that is set, of each run."""
    runs = list(table.groups("run"))
    with figure(path, 1, len(runs), figsize=(3.4 * len(runs), 3.8), squeeze=False, sharey=True) as (_, (all_axes,)):
        for axes, ((name,), rows) in zip(all_axes, runs, strict=True):
            for (knob,), rung in rows.groups("knob"):
                sizes = [max(row.get("fast full p95", 0.0), _LEAST_MM) for row in rung]
                axes.plot(rung.values("mean_us"), sizes, "o-", label=knob, markersize=3, linewidth=0.8)
                for row, size in zip(rung, sizes, strict=True):
                    axes.annotate(row["value"], (row["mean_us"], size), fontsize=5)
            axes.set(xscale="log", yscale="log", xlabel="mean run time of a tick's law, µs", title=name)
            axes.grid(alpha=0.3)
        all_axes[0].set_ylabel("95 % of |full strength's way - the finest's|, mm")
        all_axes[-1].legend(fontsize=6)


QUESTION = Question(
    "bench felt",
    FeltSweep,
    cells,
    run,
    show,
    draw,
    goals,
    failed=lambda row: row.get("largest", 0.0) > _LIMIT_M,
    timed=True,
)
