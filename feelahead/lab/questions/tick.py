"""What does a tick of the robot side cost in the real process, stage by stage and by the number of objects?

feelahead bench tick --quick
"""

import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from msgspec import Meta
from rich.console import RenderableType

from common.arrays import FloatArray
from common.errors import FeelaheadError
from feelahead.both_sides.real_time import run_for, started
from feelahead.lab.goals import Goal
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.lab.tick.timed_robot import AWAY, COLUMNS, PROGRAM, STAGES

_SETTLING_S: Final = 1.0
"""Both sides have met and each kernel has run by then."""
_LEAST_TICKS: Final = 500
_QUICK_S: Final = 4.0


@dataclass(frozen=True)
class TickSweep(Sweep):
    """Both sides as in the demo, for some seconds each, with a scripted person: the robot side's processor time.

    look to message: from the arm's readings to what leaves, without physics and without taking over a camera frame.
    """

    seconds: Annotated[float, Meta(ge=3.0, le=600.0)] = 10.0
    """Length of each case."""
    objects: tuple[Annotated[int, Meta(ge=1, le=1_000_000)], ...] = (10, 1_000, 10_000, 100_000)
    """Numbers of objects around the table, perceived besides the demo's. --quick: 1 000 at most."""


@dataclass(frozen=True)
class Case:
    """One run: with stages timed or not, further objects, and the scene's own or none."""

    case: str
    seconds: float
    stages: bool = False
    objects: int = 0
    only: bool = False


def cells(settings: TickSweep) -> Iterator[Case]:
    """Lay out the demo, an empty scene, and the numbers of objects."""
    seconds = _QUICK_S if settings.quick else settings.seconds
    yield Case("demo, each stage timed", seconds, stages=True)
    yield Case("demo", seconds)
    yield Case("nothing near, timed", seconds, stages=True, only=True)
    counts = [count for count in settings.objects if not (settings.quick and count > 1_000)]
    for count in counts:
        yield Case(f"{count} objects", seconds, objects=count)


def run(cell: Case, seed: int) -> Iterator[Row]:
    """Run one case; a row for each stage, and for the sums."""
    names = ("stages", "objects", "only")
    with tempfile.TemporaryDirectory() as folder:
        log, flags = Path(folder) / "ticks.npy", [f"--{name}={getattr(cell, name)}" for name in names]
        ours = [f"--log={log}", *flags, f"--seed={seed}", "--no-cameras"]
        with started(ours, [f"--seed={seed}"], PROGRAM) as both:
            run_for(both.robot, both.operator, cell.seconds + _SETTLING_S)
            overruns = both.summaries()[0].get("overruns")
        ticks = np.load(log)
    kept = ticks[ticks[:, 0] >= ticks[0, 0] + _SETTLING_S] if len(ticks) else ticks
    if len(kept) < _LEAST_TICKS:
        raise FeelaheadError(f"{len(kept)} ticks in {cell.seconds:g} s: this machine is too busy to measure")
    yield from rows(kept, cell.stages, overruns)


def rows(ticks: FloatArray, stages: bool, overruns: int | None) -> Iterator[Row]:
    """Give quantiles of processor time (us) of each stage, of sums of them, and of the tick's wall time."""
    spent_us = dict(zip(COLUMNS, 1e6 * ticks.T, strict=True))
    tick_us = spent_us["tick_s"]
    found = {name: spent_us[name] for name in STAGES} | {"the rest": tick_us - sum(spent_us[name] for name in STAGES)}
    found = found if stages else {}
    found |= {
        "look to message": tick_us - sum(spent_us[name] for name in AWAY),
        "tick without physics": tick_us - spent_us["physics"],
        "tick": tick_us,
        "tick, wall time": spent_us["wall_s"],
    }
    thread_s, now_s = ticks[:, COLUMNS.index("thread_s")], ticks[:, 0]
    share = float((thread_s[-1] - thread_s[0]) / (now_s[-1] - now_s[0]))
    for name, values in found.items():
        p10, p50, p99 = np.quantile(values, (0.1, 0.5, 0.99))
        row: Row = {"part": name, "p10_us": p10, "p50_us": p50, "p99_us": p99, "mean_us": values.mean()}
        yield row | ({"ticks": len(ticks), "share": share, "overruns": overruns} if name == "tick" else {})


def show(_: TickSweep, table: Table) -> Iterator[RenderableType]:
    """Show the demo's stages, and each case's sums."""
    machine = f"us of processor time; {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}"
    stages = table.where(case="demo, each stage timed")
    columns: tuple[str, ...] = ("part", "p10_us", "p50_us", "p99_us", "mean_us")
    yield shown(f"the demo's tick at 1 kHz, {machine}", columns, stages.lines(*columns))
    sums = Table(row for row in table if row["part"] in ("look to message", "tick without physics", "tick"))
    columns = ("case", "part", "p50_us", "p99_us", "share", "overruns")
    yield shown(f"by objects perceived, {machine}", columns, sums.lines(*columns))


def goals(_: TickSweep, table: Table) -> Iterator[Goal]:
    """Hold the figures against their limits."""

    def quantile(case: str, part: str, name: str = "p50_us") -> float | None:
        found = table.where(case=case, part=part).values(name)
        return float(np.median(found)) if found else None

    for name in ("demo", "1000 objects"):
        for which, limit in (("p50_us", 100.0), ("p99_us", 150.0)):
            yield Goal(f"{name}: look to message {which}", quantile(name, "look to message", which), limit)
    yield Goal("demo: tick without physics p50_us", quantile("demo", "tick without physics"), 150.0)
    yield Goal("demo: tick with physics p50_us", quantile("demo", "tick"), 250.0)
    yield Goal("nothing near: law p50_us", quantile("nothing near, timed", "law"), 30.0)
    few, many = (quantile(f"{count} objects", "look to message") for count in (10, 100_000))
    grown = None if few is None or many is None else many / few
    yield Goal("look to message p50, 100000 objects by 10", grown, 1.3)


QUESTION = Question("bench tick", TickSweep, cells, run, show, goals=goals, timed=True)
