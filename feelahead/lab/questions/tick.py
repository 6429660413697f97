"""How much processor time does a tick of the robot side take, by stage and by number of objects?

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
from common.periods import TURN_S
from feelahead.both_sides.real_time import run_for, started
from feelahead.lab.approaches.frozen import frozen_scene
from feelahead.lab.goals import Goal
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.lab.tick.concave import time_calls, time_looks
from feelahead.lab.tick.maps import MAPS, looks_at
from feelahead.lab.tick.mixed import as_ratios
from feelahead.lab.tick.timed_robot import COLUMNS, PROGRAM, STAGES
from feelahead.printing.figures import shown

_SETTLING_S: Final = 1.0
"""Time in seconds after which both sides are connected and each kernel has run."""
_LEAST_TICKS: Final = 300
_QUICK_S: Final = 4.0
_FIELDS: Final = ("mug", "u_mesh", "terrain_ahead")
"""Frozen scenes with concave objects ahead."""
_MOST_OF_PERIOD: Final = 0.25
_MOST_FIELD_MS: Final = 0.3
_MOST_MAP_MS: Final = 0.5
_LOOK: Final = "look to message"
_SENT: Final = 500
"""Number of objects that a process sends, in one frame or at 10 Hz"""


@dataclass(frozen=True)
class TickSweep(Sweep):
    """Measure the robot side's processor time, with both sides as in the demo and a scripted person.

    Each figure is shown with its ratio to "mixed", a fixed workload that takes turns with the ticks
    (feelahead/lab/tick); p50 is compared with p50, and p99 with p99. "look to message": from the arm's readings to the
    sent messages, without physics. "without physics": with telemetry and the camera's frame, which come afterwards.
    "whole look": the law, in those ticks in which it evaluated a trigger.
    """

    seconds: Annotated[float, Meta(ge=3.0, le=600.0)] = 10.0
    """Duration of each case, in seconds."""
    objects: tuple[Annotated[int, Meta(ge=1, le=1_000_000)], ...] = (10, 1_000, 10_000, 100_000)
    """Numbers of objects around the table that are perceived in addition to the demo's, one case for each number; with
    --quick only the first and the last."""


@dataclass(frozen=True)
class Case:
    """Cell with one run of both sides: stages timed or not, additional objects, and the scene's own objects or none."""

    case: str
    seconds: float
    stages: bool = False
    objects: int = 0
    only: bool = False
    sent: str = ""
    """How the additional objects come as frames: once, or again at 10 Hz"""


@dataclass(frozen=True)
class Concave:
    """Cell that measures looks at the concave object of a frozen scene."""

    case: str
    seconds: float


@dataclass(frozen=True)
class Mapped:
    """Cell that measures looks at a map of many near boxes."""

    case: str
    seconds: float


def cells(settings: TickSweep) -> Iterator[Case | Concave | Mapped]:
    """Yield the cells: the demo, an empty scene, numbers of objects, sent objects, concave objects, and maps."""
    seconds = _QUICK_S if settings.quick else settings.seconds
    yield Case("demo, each stage timed", seconds, stages=True)
    yield Case("demo", seconds)
    yield Case("nothing near, timed", seconds, stages=True, only=True)
    counts = settings.objects
    for count in dict.fromkeys(counts[:1] + counts[-1:]) if settings.quick else counts:
        yield Case(f"{count} objects", seconds, objects=count)
    for sent in ("once", "again"):
        yield Case(f"{_SENT} objects sent {sent}", seconds, objects=_SENT, sent=sent)
    for name in _FIELDS:
        yield Concave(name, seconds / 2.0)
    for name in MAPS:
        yield Mapped(name, seconds / 2.0)


def run(cell: Case | Concave | Mapped, seed: int) -> Iterator[Row]:
    """Run one cell; yield a row for each stage, and for each sum of stages."""
    if not isinstance(cell, Case):
        if isinstance(cell, Concave):
            looks_s, mixed_s = time_looks(frozen_scene(cell.case), cell.seconds)
        else:
            looks_s, mixed_s = time_calls(list(looks_at(cell.case)), cell.seconds)
        for stage, spent_s in ((f"field of {cell.case}", looks_s), ("mixed", mixed_s)):
            yield {"stage": stage, "objects": 1, **as_ratios(spent_s, mixed_s)}
        return
    names = ("stages", "objects", "only", "sent")
    with tempfile.TemporaryDirectory() as folder:
        log, flags = Path(folder) / "ticks.npy", [f"--{name}={getattr(cell, name)}" for name in names]
        ours = [f"--log={log}", *flags, f"--seed={seed}", "--no-cameras"]
        with started(ours, [f"--seed={seed}"], PROGRAM) as both:
            run_for(both.robot, both.operator, cell.seconds + _SETTLING_S)
            overruns = both.summaries()[0].get("overruns")
        turns = np.load(log)
    kept = turns[turns[:, 0] >= turns[0, 0] + _SETTLING_S] if len(turns) else turns
    if len(kept) < _LEAST_TICKS:
        raise FeelaheadError(f"{len(kept)} turns in {cell.seconds:g} s: this machine is too busy to measure")
    yield from rows(kept, cell.stages, overruns)


def rows(turns: FloatArray, stages: bool, overruns: int | None) -> Iterator[Row]:
    """Yield rows with quantiles of the processor time of stages, of their sums and of "mixed", and of wall time."""
    of_mixed = turns[:, COLUMNS.index("run")] % 2 == 1
    ticks, mixed_s = turns[~of_mixed], turns[of_mixed, COLUMNS.index("spent_s")]
    spent = dict(zip(COLUMNS, ticks.T, strict=True))
    tick_s = spent["spent_s"]
    within = sum(spent[name] for name in STAGES if name != "frame")
    found = {name: spent[name] for name in STAGES} | {"the rest": tick_s - within}
    found = found | {"whole look": spent["law"][spent["looks"] > 0.0]} if stages else {}
    found |= {
        _LOOK: tick_s - spent["physics"],
        "without physics": tick_s - spent["physics"] + spent["frame"],
        "tick": tick_s,
        "tick, wall time": spent["wall_s"],
        "mixed": mixed_s,
    }
    together = np.diff(spent["run"]) == 0.0  # without the turns of "mixed"
    share = float(np.diff(spent["thread_s"])[together].sum() / np.diff(spent["now_s"])[together].sum())
    for name, values in found.items():
        if values.size:
            more = {"p10_us": 1e6 * np.quantile(values, 0.1), "mean_us": 1e6 * values.mean(), "turns": len(values)}
            row: Row = {"stage": name, **as_ratios(values, mixed_s), **more}
            yield row | ({"share": share, "overruns": overruns} if name == "tick" else {})


def show(_: TickSweep, table: Table) -> Iterator[RenderableType]:
    """Show the demo's stages, and each case's sums."""
    machine = f"us of processor time; {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}"
    figures: tuple[str, ...] = ("p50_us", "p99_us", "p50_of_mixed", "p99_of_mixed")
    stages = table.where(case="demo, each stage timed")
    columns = ("stage", *figures, "p10_us", "mean_us")
    yield shown(f"the demo's tick, {machine}", columns, stages.lines(*columns))
    sums = Table(row for row in table if row["stage"] in (_LOOK, "without physics", "tick") or row["objects"] == 1)
    columns = ("case", "stage", *figures, "share", "overruns")
    yield shown(f"by objects perceived, {machine}", columns, sums.lines(*columns))


def goals(_: TickSweep, table: Table) -> Iterator[Goal]:
    """Yield the goals: for the turn, its growth with the number of objects, and looks."""

    def figure(name: str, **where: str) -> float | None:
        found = table.where(**where).values(name)
        return float(np.median(found)) if found else None

    p99_us = figure("p99_us", case="demo", stage="tick")
    share = None if p99_us is None else 1e-6 * p99_us / TURN_S
    yield Goal("demo: p99 of a turn, of its period", share, _MOST_OF_PERIOD)
    few, many = (figure("p50_of_mixed", case=f"{count} objects", stage=_LOOK) for count in (10, 100_000))
    grown = None if few is None or many is None else many / few
    yield Goal(f"{_LOOK} p50_of_mixed, 100000 objects by 10", grown, 1.2)
    for name in _FIELDS:
        p50_us = figure("p50_us", stage=f"field of {name}")
        yield Goal(f"field of {name} p50, ms", None if p50_us is None else 1e-3 * p50_us, _MOST_FIELD_MS)
    for name in MAPS:
        p99_us = figure("p99_us", stage=f"field of {name}")
        yield Goal(f"field of {name} p99, ms", None if p99_us is None else 1e-3 * p99_us, _MOST_MAP_MS)


QUESTION = Question("bench tick", TickSweep, cells, run, show, goals=goals, timed=True)
