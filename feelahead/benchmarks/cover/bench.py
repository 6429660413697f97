"""How closely a gripper's spheres cover it: what sticks out of them, and what of them stands out.

feelahead bench cover [--model FILE.xml... --site NAME]
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from common.command.command_line import parse_settings
from common.files.input_file import require_input_file
from common.files.output_file import require_output_file
from feelahead.benchmarks.cover.measuring import Fit, measure
from feelahead.benchmarks.cover.picture import draw
from feelahead.benchmarks.report import Goal, Report, Table, show, show_goals, write_csv
from feelahead.lab.figures import PICTURES
from feelahead.lab.progress import progress

_PROGRAM = "feelahead bench cover"
_BUILT_IN = "built-in"


@dataclass(frozen=True)
class CoverSettings:
    """How closely the spheres of grippers cover their true geoms, what they leave of the gap, and what they cost."""

    model: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE.xml...")] = ()
    """MJCF files with an arm and a gripper, measured beside the built-in one."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """The site between the fingertips of each, z along the approach."""
    points: Annotated[int, tyro.conf.arg(metavar="N")] = 200_000
    """So many points of either surface."""
    looks: Annotated[int, tyro.conf.arg(metavar="N")] = 300
    """How many looks ahead are timed."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """For where the points are."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """Write every figure there."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Draw the spheres from the front and from the side."""

    def __post_init__(self) -> None:
        if bool(self.model) != (self.site is not None):
            given, missing = ("--model", "--site") if self.site is None else ("--site", "--model")
            raise ValueError(f"{given} is given without {missing}; valid: both, or neither for the built-in gripper")
        for name, value, most in (("points", self.points, 10_000_000), ("looks", self.looks, 1_000_000)):
            if not 1 <= value <= most:
                raise ValueError(f"--{name} {value}: valid: 1 to {most}")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or a larger whole number")
        for model in self.model:
            require_input_file("--model", model, "an MJCF file")
        require_output_file("--csv", self.csv)
        require_output_file("--picture", self.picture, PICTURES)


def bench_cover(arguments: Sequence[str]) -> int:
    """Measure, write the files, print."""
    settings = parse_settings(CoverSettings, _PROGRAM, arguments)
    wanted: list[tuple[str, Path | None]] = [(_BUILT_IN, None), *((model.stem, model) for model in settings.model)]
    found = []
    with progress("grippers", len(wanted)) as advance:
        for name, model in wanted:
            site = None if model is None else settings.site
            found.append(measure(name, model, site, settings.points, settings.looks, settings.seed, time.process_time))
            advance(1.0)
    fits = [fit for fit, _ in found]
    report = _report(fits)
    # Files first: whoever reads the table may leave early.
    if settings.csv is not None:
        write_csv(settings.csv, report.figures)
    if settings.picture is not None:
        draw([(fit.name, scene) for fit, scene in found], settings.picture)
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False, markup=False)
    show(console, report.tables[0])
    show_goals(console, report.goals)
    return 0


def _report(fits: Sequence[Fit]) -> Report:
    report, rows = Report(), []
    for fit in fits:
        values = {
            "spheres": (float(fit.spheres), "1"),
            "sticks out": (fit.sticks_out_mm, "mm"),
            "stands out": (fit.stands_out_mm, "mm"),
            "made in": (fit.made_s, "s"),
            "field": (fit.field_us, "us"),
        }
        kept = "-"
        if fit.gap_mm is not None and fit.gap_kept_mm is not None:
            values |= {"gap": (fit.gap_mm, "mm"), "gap kept": (fit.gap_kept_mm, "mm")}
            kept = f"{fit.gap_kept_mm:.1f} of {fit.gap_mm:.1f}"
        report.add("cover", "spheres", fit.name, "", values)
        rows.append(
            (
                fit.name,
                f"{fit.geoms}",
                f"{fit.spheres}",
                f"{fit.sticks_out_mm:.3f}",
                f"{fit.stands_out_mm:.3f}",
                kept,
                f"{fit.made_s:.1f}",
                f"{fit.field_us:.0f}",
            )
        )
        report.goals.append(Goal(f"{fit.name}: sticks out of its spheres, mm", fit.sticks_out_mm, 0.0))
        report.goals.append(Goal(f"{fit.name}: spheres stand out, mm", fit.stands_out_mm, 3.0))
    report.tables.append(
        Table(
            "Grippers in spheres",
            ("gripper", "geoms", "spheres", "sticks out, mm", "stands out, mm", "gap kept, mm", "made, s", "field, µs"),
            rows,
            "sticks out: of the spheres; stands out: of the true geoms; made, field: processor time",
        )
    )
    return report
