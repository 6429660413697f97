"""`feelahead bench error`: what the error propagation and the prediction of the commands under way miss."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from common.clock import MonotonicClock
from common.command.command_line import parse_settings
from common.errors import FeelaheadError
from common.files.output_file import output_file, require_output_file
from feelahead.benchmarks.error.figures import prediction_figures, propagation_figures, write_figures
from feelahead.benchmarks.error.gripper import PosedGripper
from feelahead.benchmarks.error.picture import draw
from feelahead.benchmarks.error.prediction import Judged
from feelahead.benchmarks.error.propagation import BATCHES, Outcome, largest_variance, measure_propagation
from feelahead.benchmarks.error.recordings import full_speed_m_s, jobs, judge_all
from feelahead.benchmarks.error.running_time import best_microseconds, propagation_calls, seconds_of
from feelahead.benchmarks.error.spread import error_table
from feelahead.benchmarks.error.tables import failures, prediction_tables, propagation_tables
from feelahead.benchmarks.report import show
from feelahead.lab.approaches.frozen import frozen_hash
from feelahead.lab.figures import PICTURES
from feelahead.lab.progress import progress
from robot_side.simulation.scene import load_scene

PROGRAM = "feelahead bench error"
_WIDE = 150
_MOST_DRAWS = 10_000_000


@dataclass(frozen=True)
class ErrorBenchSettings:
    """Run time against error of the error propagation (eq. 5), and what the prediction of the gripper's way misses.

    First: the joints of the built-in arm are off by 1e-5 to 1e-1 rad. How far that puts the gripper off is worked out
    by eq. 5 in each configuration, once for all as in the paper, by the unscented transform, and, as the truth, by
    Monte Carlo. Second: hands pull R2 over links of 0 to 400 ms each way, in virtual time. How far the gripper goes
    from the robot's newest report until the command that is sent now takes effect is predicted from the operator's own
    commands under way, and as v t_d (eq. 8), and compared with where the arm went. --table writes the means and
    standard deviations that eq. 10 takes for it.

    The same seed gives the same figures, but for run times. Three minutes on two cores of their own.

    Try: feelahead bench error --quick
    """

    quick: bool = False
    """Under a minute: fewer draws, configurations, pulls and links."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write every figure there: part, method, case, at, quantity, value, unit."""
    table: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Write mean and standard deviation of the predictions' errors over loop age and kind of compensation there."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Draw run time against error, and error against loop age."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Of configurations and draws, and the first one of the pulls and links."""
    seeds: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """How many seeds of each pull over each link; 3 unless given, 1 with --quick."""
    draws: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Of the Monte Carlo in each configuration, in twenties; 400000 unless given, 100000 with --quick."""
    workers: Annotated[int, tyro.conf.arg(metavar="N")] = 2
    """Pulls that are recorded at the same time."""

    def __post_init__(self) -> None:
        for name, least, most in (("seed", 0, 2**32 - 1), ("seeds", 1, 10_000), ("workers", 1, 1000)):
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ValueError(f"--{name} {value}: valid: {least} to {most}")
        if self.draws is not None and (self.draws % BATCHES or not 100 * BATCHES <= self.draws <= _MOST_DRAWS):
            raise ValueError(
                f"--draws {self.draws}: valid: {100 * BATCHES} to {_MOST_DRAWS}, a multiple of {BATCHES}, whose parts"
                " tell the standard error"
            )
        require_output_file("--csv", self.csv)
        require_output_file("--table", self.table)
        require_output_file("--picture", self.picture, PICTURES)


@dataclass(frozen=True)
class Found:
    """All that was measured."""

    outcomes: Sequence[Outcome]
    microseconds: dict[str, float]
    judged: Sequence[Judged]
    failed: Sequence[str]
    """What could not be recorded, in words"""


def bench_error(arguments: Sequence[str]) -> int:
    """Run the benchmark; exit code 0 whatever the errors are."""
    settings = parse_settings(ErrorBenchSettings, PROGRAM, arguments)
    # Tables of a dozen columns: where nobody's window bounds them, they get room.
    console = Console(highlight=False) if sys.stdout.isatty() else Console(width=_WIDE, highlight=False)
    clock = MonotonicClock()
    start_s = clock.now()
    frozen = frozen_hash()
    found = measure(settings)
    for table in (*propagation_tables(found.outcomes, found.microseconds), *prediction_tables(found.judged)):
        if table.rows:
            show(console, table)
    for sentence in failures(found.outcomes):
        console.print(sentence)
    for failed in found.failed:
        console.print(f"not recorded: {failed}", markup=False)
    console.print(f"frozen scenes and limits: {frozen}; took {clock.now() - start_s:.0f} s")
    _write(settings, found, frozen)
    return 0


def measure(settings: ErrorBenchSettings) -> Found:
    """Both parts, saying how long they will take; FeelaheadError where no approach could be recorded at all."""
    wanted = jobs(settings.seed, settings.seeds or (1 if settings.quick else 3), quick=settings.quick)
    rounds, configurations = (40, 4) if settings.quick else (200, 12)
    draws = settings.draws or (100_000 if settings.quick else 400_000)
    gripper = PosedGripper(load_scene())
    with progress("propagation", configurations + 2) as advance:
        outcomes = list(measure_propagation(gripper, configurations, draws, settings.seed, lambda: advance(1.0)))
    with progress("run times", rounds) as advance:
        microseconds = best_microseconds(propagation_calls(gripper), rounds, lambda: advance(1.0))
    microseconds["once, at the start"] = 1e6 * seconds_of(lambda: largest_variance(gripper, settings.seed))
    with progress("approaches", len(wanted)) as advance:
        judged, failed = judge_all(wanted, settings.workers, lambda: advance(1.0))
    if not judged:
        raise FeelaheadError(f"no approach could be recorded: {failed[0]}")
    return Found(outcomes, microseconds, judged, failed)


def _write(settings: ErrorBenchSettings, found: Found, frozen: str) -> None:
    if settings.csv is not None:
        figures = [*propagation_figures(found.outcomes, found.microseconds), *prediction_figures(found.judged)]
        write_figures(settings.csv, figures)
    if settings.table is not None:
        with output_file("--table", settings.table) as file:
            file.write(error_table(found.judged, load_scene().robot.fingerprint, frozen, full_speed_m_s()))
    if settings.picture is not None:
        draw(found.outcomes, found.microseconds, found.judged, frozen, settings.picture)
