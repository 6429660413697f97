"""The table of faults, tried out: what the robot must do, the number to hold, what was measured.

    feelahead try faults
    feelahead try faults --repeats 100 --only real

First the rows that virtual time decides, exactly; then real processes with kill -9, SIGSTOP, cut connections and
strangers, whose times are this machine's: run it on an idle one. Ten minutes with 100 repetitions.
"""

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from common.command.command_line import parse_settings
from feelahead.experiments.faults import real_faults
from feelahead.experiments.faults.fault import Fault, Outcome
from feelahead.experiments.faults.first_side import either_side_first
from feelahead.experiments.faults.rig import Rig, RigError
from feelahead.experiments.faults.slow_viewer import slow_viewer
from feelahead.experiments.faults.unplugged import unplugged
from feelahead.experiments.faults.virtual_session_faults import SESSION_FAULTS
from feelahead.experiments.faults.virtual_stream_faults import STREAM_FAULTS
from robot_side.compiled.warm_up import warm_up

PROGRAM = "feelahead try faults"
_DECELERATION = "begins by T + 5 ms (p99), T + 20 ms (max); T = 100 ms"
Row = tuple[str, str, str, Callable[[Rig, int, Callable[[], None]], Outcome], float]


@dataclass(frozen=True)
class FaultSettings:
    """Try every fault of the table, and tell what came of it."""

    repeats: Annotated[int, tyro.conf.arg(metavar="N")] = 100
    """Decelerations of real processes to measure, all ways to break the stream together."""
    only: Literal["all", "virtual", "real"] = "all"
    """Which part."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        if not 5 <= self.repeats <= 1000:
            raise ValueError(f"--repeats {self.repeats}: valid: 5 to 1000")


REAL_ROWS: tuple[Row, ...] = (
    # (fault, safe behaviour, number, how to try it, its share of the repetitions)
    ("kill -9", "decelerate, hold; explicit re-arm; lease passes on", _DECELERATION, real_faults.killed, 0.15),
    ("operator stopped", "the same; its backlog moves nothing", _DECELERATION, real_faults.stopped, 0.5),
    ("half-open connection", "the same; what was held back is old", _DECELERATION, real_faults.cut, 0.25),
    ("robot side stopped 2 s", "disarmed", "0 old commands applied", real_faults.robot_stopped, 0.02),
    (
        "two operators, a stranger",
        "a lease; others observe",
        "0 of their commands applied",
        real_faults.intruders,
        0.04,
    ),
    ("slow viewers", "lose frames, alone", "tick p99 changes by < 10 %", slow_viewer, 0.03),
    ("reconnect storm, 50/s", "control unaffected", "no stop, memory growth < 10 MB", real_faults.storm, 0.05),
)
_PULLED_SHARE = 0.1


def try_faults(arguments: Sequence[str]) -> int:
    """Print the table; exit code 1 when the robot was unsafe in any row."""
    settings = parse_settings(FaultSettings, PROGRAM, arguments)
    console = Console(width=None if sys.stdout.isatty() else 160)
    shown = Table(title="faults", show_lines=True)
    for heading in ("fault", "safe behaviour", "number to hold", "measured", "verdict"):
        shown.add_column(heading, overflow="fold")
    outcomes: list[Outcome] = []

    def add(name: str, behaviour: str, number: str, outcome: Outcome) -> None:
        outcomes.append(outcome)
        shown.add_row(name, behaviour, number, outcome.measured, verdict(outcome))

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        if settings.only != "real":
            warm_up()
            _try_virtual((*STREAM_FAULTS, *SESSION_FAULTS), progress, add)
        if settings.only != "virtual":
            _try_real(settings.repeats, progress, add)
    console.print(shown)
    load = os.getloadavg()[0]
    console.print(f"spreads: min/p50/p99/max in ms; {os.cpu_count()} processors, load {load:.1f}", highlight=False)
    return 0 if all(outcome.safe for outcome in outcomes) else 1


def verdict(outcome: Outcome) -> str:
    """Holds, late, unsafe, or not judged, which is no success either."""
    if not outcome.judged:
        return "not judged"
    if not outcome.safe:
        return "UNSAFE"
    return "holds" if outcome.in_time else "safe, but late"


def _try_virtual(faults: Sequence[Fault], progress: Progress, add: Callable[[str, str, str, Outcome], None]) -> None:
    bar = progress.add_task("virtual time", total=len(faults))
    for fault in faults:
        progress.update(bar, description=f"virtual time: {fault.name}")
        add(f"{fault.name} (virtual)", fault.safe_behaviour, fault.number, fault.run())
        progress.advance(bar)


def _try_real(repeats: int, progress: Progress, add: Callable[[str, str, str, Outcome], None]) -> None:
    counts = [max(1, round(share * repeats)) for *_, share in REAL_ROWS]
    pulls = max(1, round(_PULLED_SHARE * repeats))
    bar = progress.add_task("real processes", total=1 + sum(counts) + pulls)
    add("either side starts first", "disarmed until healthy", "link up in 1 s", either_side_first())
    progress.advance(bar)
    for (name, behaviour, number, run, _), count in zip(REAL_ROWS, counts, strict=True):
        progress.update(bar, description=f"real processes: {name}")
        try:
            # Each row has a rig of its own: what one leaves behind is nothing to the next.
            with Rig() as rig:
                outcome = run(rig, count, lambda: progress.advance(bar))
        except RigError as error:
            outcome = Outcome(False, str(error), judged=False)
        add(name, behaviour, number, outcome)
    progress.update(bar, description="real processes: cable pulled")
    try:
        outcome = unplugged(pulls, lambda: progress.advance(bar))
    except RigError as error:
        outcome = Outcome(False, str(error), judged=False)
    add("cable pulled (network namespaces)", "the same as kill -9; the same once it is back", _DECELERATION, outcome)
