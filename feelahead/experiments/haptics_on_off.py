"""The same scripted person with and without haptics, over the same seeds: what the stiffness changes.

    feelahead try haptics --link "delay 200ms 10ms distribution normal" --seeds 10

Everything runs in virtual time, so the same command prints the same table. The person is simulated: nothing
here is a claim about people.
"""

import csv
import multiprocessing
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, fields
from pathlib import Path
from statistics import mean
from typing import Annotated

import tyro
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.command.command_line import parse_settings
from common.emulation.clauses import LinkModel
from common.emulation.spec import LinkSpec
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from operator_side.settings import OperatorSettings
from operator_side.simulated_person.person import PersonSettings
from robot_side.settings import RobotSettings

_PROGRAM = "feelahead try haptics"


@dataclass(frozen=True)
class ComparisonSettings:
    """What is compared: pairs of runs that differ in nothing but whether the triggers stiffen."""

    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = "delay 200ms 10ms distribution normal"
    """The emulated link, in netem's words."""
    link_model: LinkModel = "datagram"
    """datagram lets jitter reorder messages, stream keeps them in order."""
    seeds: Annotated[int, tyro.conf.arg(metavar="N")] = 10
    """How many pairs; the seeds are 0 to N-1."""
    duration: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 20.0
    """Of each run, in virtual time."""
    workers: Annotated[int, tyro.conf.arg(metavar="N")] = 2
    """Runs at the same time."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write every run's figures there."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file; [person] changes the person's limits."""
    person: PersonSettings = field(default_factory=PersonSettings)

    def __post_init__(self) -> None:
        LinkSpec.parse(self.link, 0, self.link_model)
        for name, lowest in (("seeds", 1), ("workers", 1)):
            if getattr(self, name) < lowest:
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {lowest} or more")
        if not 0.0 < self.duration < 1e4:
            raise ValueError(f"--duration {self.duration}: valid: above 0 and below 10000 seconds")


@dataclass(frozen=True)
class Outcome:
    """One run's figures."""

    seed: int
    haptics: bool
    obstacle_contacts: int
    target_contacts: int
    min_obstacle_distance_mm: float | None
    time_to_grasp_s: float | None
    lifted_mm: float
    mean_enlargement_moving_mm: float | None


def run(settings: ComparisonSettings, seed: int, *, haptics: bool) -> Outcome:
    """One run in virtual time."""
    link, model = settings.link, settings.link_model
    robot = RobotSettings(link=link, link_model=model, seed=seed)
    operator = OperatorSettings(link=link, link_model=model, seed=seed, haptics=haptics, person=settings.person)
    both = Loopback(LoopbackSettings(robot, operator))
    both.run_until(settings.duration)
    summary = both.summary()
    task = summary["task"]
    return Outcome(
        seed,
        haptics,
        task["obstacle_contacts"],
        task["contacts_by_object"].get("target", 0),
        task["min_obstacle_distance_mm"],
        task["time_to_grasp_s"],
        task["lifted_mm"],
        summary["enlargement_mm"]["mean_moving"],
    )


def compare(settings: ComparisonSettings) -> list[Outcome]:
    """Every run, off before on for each seed."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(settings.workers, mp_context=context) as pool, Progress(transient=True) as progress:
        bar = progress.add_task("runs", total=2 * settings.seeds)
        futures = [
            pool.submit(run, settings, seed, haptics=haptics)
            for seed in range(settings.seeds)
            for haptics in (False, True)
        ]
        for future in futures:
            future.add_done_callback(lambda _: progress.advance(bar))
        return [future.result() for future in futures]


def table(outcomes: Sequence[Outcome]) -> Table:
    """A row for each seed, off / on, and one for all of them."""
    shown = Table(title="haptics off / on")
    headings = ("contacts with obstacles", "with the target", "least distance to an obstacle, mm", "time to grasp, s")
    for heading in ("seed", *headings, "lifted, mm"):
        shown.add_column(heading, justify="right")
    off, on = ([one for one in outcomes if one.haptics is haptics] for haptics in (False, True))
    for without, felt in zip(off, on, strict=True):
        shown.add_row(str(without.seed), *_cells([without], [felt]))
    shown.add_section()
    shown.add_row("sum or mean", *_cells(off, on))
    return shown


def _cells(off: Sequence[Outcome], on: Sequence[Outcome]) -> list[str]:
    def pair(name: str, digits: int) -> str:
        return " / ".join(_average([getattr(one, name) for one in part], digits) for part in (off, on))

    def total(name: str) -> str:
        return " / ".join(str(sum(getattr(one, name) for one in part)) for part in (off, on))

    return [
        total("obstacle_contacts"),
        total("target_contacts"),
        pair("min_obstacle_distance_mm", 1),
        pair("time_to_grasp_s", 2),
        pair("lifted_mm", 0),
    ]


def _average(values: Sequence[float | None], digits: int) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return "never"
    missing = f" ({len(values) - len(known)} never)" if len(known) < len(values) else ""
    return f"{mean(known):.{digits}f}{missing}"


def try_haptics(arguments: Sequence[str]) -> int:
    """Compare, print the table and write the CSV."""
    settings = parse_settings(ComparisonSettings, _PROGRAM, arguments)
    outcomes = compare(settings)
    Console(width=120 if not sys.stdout.isatty() else None).print(table(outcomes))
    if settings.csv is not None:
        with settings.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            names = [column.name for column in fields(Outcome)]
            writer.writerow(names)
            writer.writerows([getattr(one, name) for name in names] for one in outcomes)
    return 0
