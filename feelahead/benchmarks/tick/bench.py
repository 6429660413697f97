"""`feelahead bench tick`: what a tick of the robot side costs in the real process, stage by stage and by objects."""

import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.console import Console
from rich.progress import Progress

from common.arrays import FloatArray
from common.command.command_line import parse_settings
from common.errors import FeelaheadError
from feelahead.benchmarks.report import Figure, Goal, Table, show, show_goals, write_csv
from feelahead.benchmarks.tick.allocations import allocations, goals, tables
from feelahead.benchmarks.tick.timed_robot import AWAY, COLUMNS, STAGES
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.real_time import START_S, run_for
from feelahead.both_sides.summary import read_summary

_PROGRAM: Final = "feelahead bench tick"
_SETTLING_S: Final = 1.0
"""Until both sides have met and each kernel has run."""
_LEAST_TICKS: Final = 500
_WHOLE: Final = ("--stages=False",)


@dataclass(frozen=True)
class TickSettings:
    """Both sides as in the demo, for some seconds each, with a scripted person: the robot side's processor time.

    look to message: from the arm's readings to what leaves, without physics and without taking over a camera frame.
    """

    seconds: float = 10.0
    """Of each case."""
    objects: tuple[int, ...] = (10, 1_000, 10_000, 100_000)
    """So many more objects than the demo's are perceived, around the table."""
    quick: bool = False
    """4 s each, and 1 000 objects at most."""
    csv: Path | None = None
    """Each figure as a row."""
    allocations: int | None = None
    """Instead: whether memory stays flat over so many ticks in virtual time, and what allocates arrays; on Linux."""

    def __post_init__(self) -> None:
        if not 3.0 <= self.seconds <= 600.0:
            raise ValueError(f"--seconds {self.seconds}: valid: 3 to 600")
        if self.allocations is not None and not 100 <= self.allocations <= 100_000_000:
            raise ValueError(f"--allocations {self.allocations}: valid: 100 to 100000000")
        if not all(0 < count <= 1_000_000 for count in self.objects):
            raise ValueError(f"--objects {self.objects}: valid: 1 to 1000000 each")


@dataclass(frozen=True)
class Case:
    """One run."""

    name: str
    arguments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ticks:
    """What one run's ticks cost."""

    name: str
    rows: FloatArray
    """(t, columns) of the timed robot side"""
    summary: dict[str, Any]
    share: float
    """Of a processor, that the robot side's thread took"""

    def spent_us(self, *stages: str) -> FloatArray:
        """(t,) processor time of these together; `tick`: of everything."""
        spent: FloatArray = 1e6 * self.rows[
            :, [COLUMNS.index("tick_s" if stage == "tick" else stage) for stage in stages]
        ].sum(1)
        return spent

    @property
    def look_to_message_us(self) -> FloatArray:
        """(t,)"""
        return self.spent_us("tick") - self.spent_us(*AWAY)

    @property
    def without_physics_us(self) -> FloatArray:
        """(t,)"""
        return self.spent_us("tick") - self.spent_us("physics")


def bench_tick(arguments: Sequence[str]) -> int:
    """Measure, print, and compare with the goals."""
    settings = parse_settings(TickSettings, _PROGRAM, arguments)
    if settings.allocations is not None:
        return _bench_allocations(settings.allocations, settings.csv)
    counts = [count for count in settings.objects if not (settings.quick and count > 1_000)]
    cases = [
        Case("demo, each stage timed"),
        Case("demo", _WHOLE),
        Case("nothing near, timed", ("--only=True",)),
        *(Case(f"{count} objects", (f"--objects={count}", *_WHOLE)) for count in counts),
        *(
            Case(f"{count} objects, 100 move", (f"--objects={count}", "--moving=100", *_WHOLE))
            for count in counts
            if count >= 1_000
        ),
    ]
    console = Console(width=100 if not sys.stdout.isatty() else None)
    with Progress(transient=True, console=console) as progress:
        bar = progress.add_task("cases", total=len(cases))
        found = []
        for case in cases:
            found.append(_run(case, 4.0 if settings.quick else settings.seconds))
            progress.advance(bar)
    for table in (_stages(found[0]), _by_case(found)):
        show(console, table)
    show_goals(console, _goals({ticks.name: ticks for ticks in found}))
    if settings.csv is not None:
        write_csv(settings.csv, [figure for ticks in found for figure in _figures(ticks)])
    return 0


def _bench_allocations(ticks: int, csv: Path | None) -> int:
    console, found = Console(width=100 if not sys.stdout.isatty() else None), allocations(ticks)
    for table in tables(found):
        show(console, table)
    show_goals(console, goals(found))
    if csv is not None:
        places = [(f"{line.place} bytes", line.bytes_a_tick, "B") for line in found.lines]
        resident = [("resident", value, "MB") for value in found.resident_mb]
        write_csv(csv, [Figure("tick", "ours", "", "allocations", *each) for each in (*resident, *places)])
    return 0


def _run(case: Case, seconds: float) -> Ticks:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, summary = folder / "ticks.npy", folder / "robot.json"
        ours = [f"--log={log}", f"--summary={summary}", "--bind=tcp://127.0.0.1:0", "--no-cameras", *case.arguments]
        with SideProcess("feelahead.benchmarks.tick.timed_robot", "robot", ours) as robot:
            listening = robot.wait_for("listening", START_S)
            theirs = ["--device=simulated", f"--connect={listening['control']}", f"--view-connect={listening['view']}"]
            with SideProcess("operator_side", "operator", theirs) as operator:
                run_for(robot, operator, seconds + _SETTLING_S)
        rows = np.load(log)
        kept = rows[rows[:, 0] >= rows[0, 0] + _SETTLING_S] if len(rows) else rows
        if len(kept) < _LEAST_TICKS:
            raise FeelaheadError(
                f"{case.name}: {len(kept)} ticks in {seconds:g} s: this machine is too busy to measure"
            )
        thread = kept[:, COLUMNS.index("thread_s")]
        share = float((thread[-1] - thread[0]) / (kept[-1, 0] - kept[0, 0]))
        return Ticks(case.name, kept, read_summary(summary), share)


def _quantiles(values: FloatArray) -> tuple[float, float]:
    middle, late = np.quantile(values, (0.5, 0.99))
    return float(middle), float(late)


def _shown(values: FloatArray) -> tuple[str, str]:
    middle, late = _quantiles(values)
    return f"{middle:.0f}", f"{late:.0f}"


def _stage(name: str, values: FloatArray) -> tuple[str, ...]:
    return name, f"{np.quantile(values, 0.1):.0f}", *_shown(values), f"{values.mean():.1f}"


def _stages(ticks: Ticks) -> Table:
    rest = ticks.spent_us("tick") - ticks.spent_us(*STAGES)
    rows = [_stage(stage, ticks.spent_us(stage)) for stage in STAGES]
    rows.append(_stage("the rest", rest))
    wall = 1e6 * ticks.rows[:, COLUMNS.index("wall_s")]
    for name, values in (
        ("look to message", ticks.look_to_message_us),
        ("tick without physics", ticks.without_physics_us),
        ("tick", ticks.spent_us("tick")),
        ("tick, wall time", wall),
    ):
        rows.append(_stage(name, values))
    return Table(
        f"the demo's tick at 1 kHz, us of processor time; {len(ticks.rows)} ticks, {os.cpu_count()} processors,"
        f" load {os.getloadavg()[0]:.1f}",
        ("stage", "p10", "p50", "p99", "mean"),
        rows,
        "Wall less processor time is what the machine took away; p10 is least of its varying speed.",
    )


def _by_case(found: Sequence[Ticks]) -> Table:
    rows = []
    for ticks in found:
        rows.append(
            (
                ticks.name,
                *_shown(ticks.look_to_message_us),
                *_shown(ticks.without_physics_us),
                *_shown(ticks.spent_us("tick")),
                f"{100.0 * ticks.share:.0f} %",
                f"{ticks.summary['overruns']}",
            )
        )
    return Table(
        "by what is perceived, us of processor time",
        ("case", "look to message p50", "p99", "without physics p50", "p99", "tick p50", "p99", "thread", "overruns"),
        rows,
    )


def _goals(found: dict[str, Ticks]) -> list[Goal]:
    goals = []
    for name in ("demo", "1000 objects"):
        if name in found:
            middle, late = _quantiles(found[name].look_to_message_us)
            goals += [
                Goal(f"{name}: look to message p50, us", middle, 100.0),
                Goal(f"{name}: look to message p99, us", late, 150.0),
            ]
    goals.append(Goal("demo: tick without physics p50, us", _quantiles(found["demo"].without_physics_us)[0], 150.0))
    goals.append(Goal("demo: tick with physics p50, us", _quantiles(found["demo"].spent_us("tick"))[0], 250.0))
    nothing = _quantiles(found["nothing near, timed"].spent_us("law"))[0]
    goals.append(Goal("nothing near: what is ahead p50, us", nothing, 30.0))
    few, many = found.get("10 objects"), found.get("100000 objects")
    if few is not None and many is not None:
        growth = _quantiles(many.look_to_message_us)[0] / _quantiles(few.look_to_message_us)[0]
        goals.append(Goal("look to message p50, 100000 objects by 10", growth, 1.3))
    return goals


def _figures(ticks: Ticks) -> list[Figure]:
    values = {stage: ticks.spent_us(stage) for stage in (*STAGES, "tick") if ticks.spent_us(stage).any()}
    values |= {"look to message": ticks.look_to_message_us, "without physics": ticks.without_physics_us}
    return [
        Figure("tick", "ours", "", ticks.name, f"{name} {quantity}", value, "us")
        for name, some in values.items()
        for quantity, value in zip(("p50", "p99"), _quantiles(some), strict=True)
    ]
