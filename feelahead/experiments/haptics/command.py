"""The same scripted person with and without haptics, over the same seeds: what the stiffness changes.

    feelahead try haptics --scenes wall slot shelf --delays 0 100 200 400 --seeds 30 --csv FILE

Everything runs in virtual time, so the same command prints the same tables. The person is simulated: nothing here is
a claim about people.
"""

import csv
import sys
from collections.abc import Sequence
from dataclasses import asdict, astuple, dataclass, field, fields
from itertools import product
from pathlib import Path
from statistics import median
from typing import Annotated

import tyro
from rich.box import MARKDOWN
from rich.console import Console
from rich.table import Table

from common.command.command_line import parse_settings
from common.emulation.clauses import LinkModel
from common.files.output_file import output_file, require_output_file
from feelahead.experiments.haptics.statistics import exact_interval, mcnemar_p, mean_difference_interval, restricted
from feelahead.lab.approaches.kept import Kept
from feelahead.lab.approaches.processes import in_processes
from feelahead.lab.progress import progress
from feelahead.lab.trial import Arm, Result, Trial, run_trial
from operator_side.simulated_person.settings import PersonSettings
from robot_side.simulation.built_in_scenes import SceneName

_PROGRAM = "feelahead try haptics"
ARMS: tuple[Arm, ...] = ("off", "mechanical", "reacting")
_IN_WORDS = {"off": "off", "mechanical": "on, no notice taken", "reacting": "on, reacts"}


def link_of(delay_ms: float, jitter_ms: float) -> str:
    """The emulated link, both ways; without a delay there is no jitter either."""
    return f"delay {delay_ms:g}ms {jitter_ms:g}ms distribution normal" if delay_ms else ""


@dataclass(frozen=True)
class ComparisonSettings:
    """Trials of a person who sees distances wrongly and no obstacle: without haptics, with, and with and noticing.

    They reach for the target in single moves, grasp it, lift it and set it down again. Trials with the same seed differ
    in nothing but what is felt: the same scene, errors of camera and link, misjudged distances.
    """

    scenes: tuple[SceneName, ...] = ("wall", "slot", "shelf")
    """wall: behind the target. slot: between two posts. shelf: over an edge. table: clutter beside the way."""
    delays: Annotated[tuple[float, ...], tyro.conf.arg(metavar="MS...")] = (0.0, 100.0, 200.0, 400.0)
    """Each way, in milliseconds."""
    jitter: Annotated[float, tyro.conf.arg(metavar="MS")] = 10.0
    """Standard deviation of each delay above 0."""
    camera_mm: Annotated[float, tyro.conf.arg(metavar="MM")] = 3.0
    """How far wrong the camera is, and is known to be: standard deviation along each axis."""
    link_model: LinkModel = "datagram"
    """datagram lets jitter reorder messages, stream keeps them in order."""
    seeds: Annotated[int, tyro.conf.arg(metavar="N")] = 30
    """How many pairs; the seeds are 0 to N-1."""
    duration: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 45.0
    """The limit of each trial, in virtual time."""
    tick: Annotated[float, tyro.conf.arg(metavar="MS")] = 4.0
    """Period of the robot side's ticks, in milliseconds; 1 is the real one, and takes more than twice the time."""
    workers: Annotated[int, tyro.conf.arg(metavar="N")] = 2
    """Trials at the same time."""
    resume: Annotated[Path | None, tyro.conf.arg(metavar="FILE.jsonl")] = None
    """Write each trial there as soon as it is done, and leave out what is there already."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write every trial's figures there."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file; [person] changes the person's limits."""
    person: PersonSettings = field(
        default_factory=lambda: PersonSettings(aiming="move-and-wait", depth_error_sd_m=0.030, depth_error_mean_m=0.010)
    )

    def __post_init__(self) -> None:
        for name, lowest in (("seeds", 1), ("workers", 1)):
            if getattr(self, name) < lowest:
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {lowest} or more")
        if self.person.pull_n is not None:
            raise ValueError(f"--person.pull-n {self.person.pull_n}: valid: not here, where a task is done")
        if not 0.0 < self.duration < 1e4:
            raise ValueError(f"--duration {self.duration}: valid: above 0 and below 10000 seconds")
        if not 0.0 <= self.jitter <= 1000.0:
            raise ValueError(f"--jitter {self.jitter}: valid: 0 to 1000 milliseconds")
        if not 0.0 <= self.camera_mm <= 1000.0:
            raise ValueError(f"--camera-mm {self.camera_mm}: valid: 0 to 1000 millimetres")
        if not 1.0 <= self.tick <= 10.0:
            raise ValueError(f"--tick {self.tick}: valid: 1 to 10 milliseconds")
        require_output_file("--resume", self.resume)
        require_output_file("--csv", self.csv)
        for name in ("scenes", "delays"):
            values = getattr(self, name)
            if not values or len(set(values)) < len(values):
                raise ValueError(f"--{name} {' '.join(map(str, values))}: valid: one or more, each once")
        for delay_ms in self.delays:
            # Beyond this loop age the robot side is never armed.
            if not 0.0 <= delay_ms < 1000.0:
                raise ValueError(f"--delays {delay_ms}: valid: 0 to below 1000 milliseconds")


@dataclass(frozen=True)
class Row:
    """One trial, as written to the CSV."""

    scene: SceneName
    delay_ms: float
    arm: Arm
    seed: int
    result: Result


def compare(settings: ComparisonSettings) -> list[Row]:
    """Every trial, in the order of scenes, delays, arms and seeds; all others before another seed is begun."""
    keys = list(product(settings.scenes, settings.delays, ARMS, range(settings.seeds)))
    names = {key: "{}/{:g} ms/{}/{}".format(*key) for key in keys}
    same = ("jitter", "camera_mm", "link_model", "duration", "tick", "person")
    kept = Kept(settings.resume, {"trials": {name: asdict(settings)[name] for name in same}})
    todo = sorted((key for key in keys if names[key] not in kept.done), key=lambda key: key[-1])
    trials = [
        Trial(
            scene,
            link_of(delay_ms, settings.jitter),
            arm,
            settings.person,
            settings.duration,
            settings.link_model,
            1e-3 * settings.tick,
            1e-3 * settings.camera_mm,
        )
        for scene, delay_ms, arm, _ in todo
    ]
    try:
        with progress("trials", float(len(todo))) as advance:
            for place, result in in_processes(
                run_trial, [(trial, key[-1]) for trial, key in zip(trials, todo, strict=True)], settings.workers
            ):
                kept.keep(names[todo[place]], [asdict(result)])
                advance(1.0)
    finally:
        kept.close()
    return [Row(*key, Result(**kept.done[names[key]][0])) for key in keys]


def tables(settings: ComparisonSettings, rows: Sequence[Row]) -> list[Table]:
    """One for each scene and delay, a row for each arm."""
    made = []
    for scene, delay_ms in product(settings.scenes, settings.delays):
        # As Markdown, for docs/measurements.md.
        table = Table(title=f"{scene}, {delay_ms:g} ms each way, {settings.seeds} pairs", box=MARKDOWN)
        for heading in (
            *("haptics", "trials with a hit [95 %]", "p", "hits", "mm/s, median (most)", "grasped", "placed"),
            *("felt first", "finished, s", "longer by [95 %]"),
        ):
            table.add_column(heading, justify="left" if heading == "haptics" else "right")
        by_arm = {
            arm: [row.result for row in rows if (row.scene, row.delay_ms, row.arm) == (scene, delay_ms, arm)]
            for arm in ARMS
        }
        for arm in ARMS:
            table.add_row(_IN_WORDS[arm], *_cells(by_arm["off"], by_arm[arm], settings.duration, paired=arm != "off"))
        made.append(table)
    return made


def _cells(off: Sequence[Result], those: Sequence[Result], limit_s: float, *, paired: bool) -> list[str]:
    hit, hit_off = [one.hits > 0 for one in those], [one.hits > 0 for one in off]
    low, high = exact_interval(sum(hit), len(hit))
    speeds = [one.fastest_hit_mm_s for one in those if one.fastest_hit_mm_s is not None]
    times, times_off = (restricted([one.finished_s for one in part], limit_s) for part in (those, off))
    longer = ""
    if paired:
        less, more = mean_difference_interval(times_off, times)
        longer = f"{(times - times_off).mean():+.1f} [{less:+.1f}, {more:+.1f}]"
    placed = [one for one in those if one.placed]
    return [
        f"{sum(hit)}/{len(hit)} [{100 * low:.0f} to {100 * high:.0f} %]",
        f"{mcnemar_p(hit_off, hit):.2g}" if paired else "",
        str(sum(one.hits for one in those)),
        f"{median(speeds):.0f} ({max(speeds):.0f})" if speeds else "",
        f"{sum(one.grasped for one in those)}",
        f"{len(placed)}",
        f"{sum(one.felt_before_s is not None for one in placed)}",
        f"{times.mean():.1f}",
        longer,
    ]


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """A line for each trial."""
    with output_file("--csv", path) as file:
        writer = csv.writer(file)
        writer.writerow(["scene", "delay_ms", "arm", "seed", *(column.name for column in fields(Result))])
        writer.writerows([row.scene, row.delay_ms, row.arm, row.seed, *astuple(row.result)] for row in rows)


def try_haptics(arguments: Sequence[str]) -> int:
    """Compare, print the tables and write the CSV."""
    settings = parse_settings(ComparisonSettings, _PROGRAM, arguments)
    rows = compare(settings)
    if settings.csv is not None:
        write_rows(settings.csv, rows)
    console = Console(width=160 if not sys.stdout.isatty() else None)
    for table in tables(settings, rows):
        console.print(table)
    return 0
