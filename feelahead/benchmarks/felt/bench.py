"""`feelahead bench felt`: run time against error of what is felt, as the look ahead is set otherwise."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro
from rich.console import Console

from common.command.command_line import parse_settings
from common.files.output_file import output_file, require_output_file
from feelahead.benchmarks.felt.approaching import SCENES
from feelahead.benchmarks.felt.equality import Differences, compare
from feelahead.benchmarks.felt.ladders import ladders
from feelahead.benchmarks.felt.measuring import RUNS, Found, Plan, measure, pieces
from feelahead.benchmarks.felt.recorded_ticks import DEMO, record
from feelahead.benchmarks.felt.tables import draw, report
from feelahead.benchmarks.felt.turning import Turned
from feelahead.benchmarks.report import Report, Table, markdown, show, write_csv
from feelahead.lab.progress import progress

_PROGRAM: Final = "feelahead bench felt"
_QUICK_RUNS: Final = (DEMO, "mug")
_QUICK_S: Final = 3.0
_QUICK_TIMES: Final = 2
_LIMIT_M: Final = 1e-12
_NOTE: Final = (
    "Each setting is asked the same recorded ticks, one thing set otherwise at a time; µs of processor time of the law"
    " in a tick, the least of several passes that take turns. Ways of both triggers, first and full strength (of what"
    " is to be touched: half), against the finest setting of the same thing, its last row: the mean, the 95th"
    " percentile of the size, the earliest and the latest. Above 0 is felt too late, below 0 too early. A tick is"
    " compared if either feels something within the horizon. Single ticks are far apart where something enters or"
    " leaves the way, which one setting sees sooner, and where a graze is full for one and not for the other."
)


@dataclass(frozen=True)
class FeltSettings:
    """What the look ahead costs and how well it is felt, as it is set otherwise: how often it looks, how many ticks
    later a look is known, how many spheres cover the gripper, how finely overlaps grow along a way, and meshes as
    their convex hulls. Recorded ticks of the demo and of pulls, and approaches in virtual time.
    """

    quick: bool = False
    """Two runs of 3 s, and approaches to two scenes."""
    equality: bool = False
    """Instead: the demo's 10 000 ticks by the compiled law and by plain NumPy; how far the two are apart."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Of the errors that the camera and the encoders have."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """Write every figure there."""
    write_docs: Annotated[Path | None, tyro.conf.arg(metavar="FILE.md")] = None
    """Write the tables as Markdown there, and the picture beside it."""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or more")
        if self.equality and (self.csv is not None or self.write_docs is not None):
            raise ValueError("--equality with --csv or --write-docs: valid: --equality alone, or with --quick")
        require_output_file("--csv", self.csv)
        require_output_file("--write-docs", self.write_docs)

    def plan(self) -> Plan:
        """How much of it."""
        if self.quick:
            return Plan(_QUICK_RUNS, _QUICK_S, _QUICK_S, _QUICK_TIMES, SCENES[:2], self.seed)
        return Plan(RUNS, scenes=SCENES, seed=self.seed)


def bench_felt(arguments: Sequence[str]) -> int:
    """Measure, write, print; with --equality 1 where the two are farther apart than 1e-12 m."""
    settings = parse_settings(FeltSettings, _PROGRAM, arguments)
    console = Console(width=None if sys.stdout.isatty() else 200, highlight=False, markup=False)
    if settings.equality:
        return _equality(settings, console)
    plan, rungs = settings.plan(), ladders(quick=settings.quick)
    with progress("settings", pieces(plan, rungs)) as advance:
        found = measure(plan, rungs, advance)
    made = report(found, rungs)
    if settings.csv is not None:
        write_csv(settings.csv, made.figures)
    if settings.write_docs is not None:
        write_page(settings, settings.write_docs, found, rungs, made)
    for table in made.tables:
        show(console, table)
    console.print(_NOTE)
    return 0


def _equality(settings: FeltSettings, console: Console) -> int:
    recorded = record(DEMO, _QUICK_S if settings.quick else 10.0, settings.seed)
    with progress("ticks", float(len(recorded.ticks))) as advance:
        found = compare(recorded, lambda _: advance(1.0))
    show(console, _compared(found))
    return 0 if max(found.largest.values()) <= _LIMIT_M else 1


def _compared(found: Differences) -> Table:
    return Table(
        f"The compiled law beside plain NumPy: {found.ticks} ticks of the demo, {found.looks} looks, {found.ways} ways",
        ("what", "largest difference"),
        [(name, f"{value:.1e}") for name, value in found.largest.items()],
    )


def write_page(settings: FeltSettings, path: Path, found: Found, rungs: dict[str, list[Turned]], made: Report) -> None:
    """The tables as Markdown, and a picture beside them."""
    picture = path.with_suffix(".png")
    draw(found, rungs, picture)
    quick = " --quick" if settings.quick else ""
    seed = f" --seed {settings.seed}" if settings.seed else ""
    lines = [
        "# Run time against error of what is felt",
        "",
        f"    {_PROGRAM}{quick}{seed} --write-docs docs/benchmarks/felt.md",
        "",
        f"On {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}. {_NOTE}",
        "",
        f"![run time against error]({picture.name})",
        "",
        *(markdown(table) for table in made.tables),
    ]
    with output_file("--write-docs", path) as file:
        file.write("\n".join(lines))
