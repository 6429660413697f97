"""How exact are the law's onset distances, and how closely do spheres cover a gripper?

feelahead bench felt
feelahead bench felt --cover
feelahead bench felt --field --picture onsets.png
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro
from msgspec import Meta
from rich.table import Table as Shown

from common.files.input_file import require_input_file
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, PASSED, SITE, frozen_hash, frozen_scene, scene_names
from feelahead.lab.approaches.ticks import DEMO, record
from feelahead.lab.cover import STANDS_OUT, Gripper, draw_cover, measure_cover
from feelahead.lab.field import CONVEX, DRAWN, Facing, draw_field, look_ahead, strength_column
from feelahead.lab.goals import Goal
from feelahead.lab.reference.looks import LATE_M, compare, looks_of
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from robot_side.settings import RobotSettings

_LIMIT_COVER_MM: Final = 1e3 * RobotSettings().cover_m
_ROUNDING_MM: Final = 1e-9
_QUICK_POINTS: Final = 10_000
_QUICK_SCENES: Final = 2
_PULLED_ASIDE: Final = ("rod_5mm", "ball", "slot", "mug", "u_mesh", "terrain_ahead", "cluttered")


@dataclass(frozen=True)
class FeltSweep(Sweep):
    """Compare the onset distances of looks, in the demo and in all frozen scenes, with their definition."""

    cover: bool = False
    """Do this instead: measure how closely spheres cover grippers, of the built-in arm and of --model."""
    field: bool = False
    """Do this instead: measure how far before objects R2's strengths begin, without camera error. The objects of the
    frozen scenes with one convex object ahead, or of --model, are moved along the approach."""
    model: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE.xml...")] = ()
    """For --cover and --field: MJCF files, each with an arm."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """For --cover and --field: name of the site between the fingertips, whose z axis is the approach."""
    points: Annotated[int, Meta(ge=100, le=10_000_000), tyro.conf.arg(metavar="N")] = 200_000
    """For --cover: number of points sampled on each of both surfaces, shared among a gripper's links."""
    step_mm: Annotated[float, Meta(ge=1.0, le=150.0), tyro.conf.arg(metavar="MM")] = 10.0
    """For --field: step between the tried distances from gripper to object, 0 to 150 mm."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cover and self.field:
            raise ValueError("--cover and --field exclude each other; valid: one of them")
        if self.picture is not None and not (self.cover or self.field):
            raise ValueError(f"--picture {self.picture}: errors have no figure; valid: with --cover or --field")
        if (self.model or self.site is not None) and not (self.cover or self.field):
            raise ValueError("--model and --site are only for --cover and --field; valid: with one of these two")
        if self.cover and bool(self.model) != (self.site is not None):
            raise ValueError("--cover is given with only one of --model and --site; valid: both, or neither")
        for model in self.model:
            require_input_file("--model", model, "an MJCF file")

    def scenes(self) -> dict[Path, str]:
        """Return the names of the scenes of --field, by file."""
        frozen = CONVEX[:_QUICK_SCENES] if self.quick else CONVEX
        return scene_names(self.model or tuple(frozen_scene(name) for name in frozen))


@dataclass(frozen=True)
class Looked:
    """Cell whose recorded looks are compared with the definition."""

    scene: str
    duration_s: float
    most: int
    sticks_of: str = ""
    """Scene whose stick deflections are used, instead of those of the run's own scene."""


def cells(settings: FeltSweep) -> Iterator[Looked | Gripper | Facing]:
    """Yield the cells that the flags choose: looks, grippers, or scenes."""
    if settings.cover:
        points = min(settings.points, _QUICK_POINTS) if settings.quick else settings.points
        yield Gripper("built-in", None, None, points)
        for model, name in scene_names(settings.model).items():
            yield Gripper(name, model, settings.site, points)
    elif settings.field:
        for model, name in settings.scenes().items():
            yield Facing(name, model, settings.site or SITE, settings.step_mm)
    else:
        yield Looked(DEMO, 6.0, 200) if settings.quick else Looked(DEMO, 20.0, 2000)
        for scene in ("mug",) if settings.quick else (*AHEAD, *ASIDE, *PASSED):
            yield Looked(scene, 2.0 if settings.quick else 4.0, 40)
            for aside in () if settings.quick or scene not in _PULLED_ASIDE else ASIDE:
                yield Looked(scene, 3.0, 40, aside)


def run(cell: Looked | Gripper | Facing, seed: int) -> Iterator[Row]:
    """Run one cell: yield a row of errors of a recorded run's looks, or the rows of --cover or --field."""
    if isinstance(cell, Looked):
        recorded = record(cell.scene, cell.duration_s, seed, ASIDE.get(cell.sticks_of))
        yield dict(compare(*looks_of(recorded, cell.most)).row())
    else:
        yield from measure_cover(cell, seed) if isinstance(cell, Gripper) else look_ahead(cell)


def show(settings: FeltSweep, table: Table) -> Iterator[Shown]:
    """Yield the table of errors, or that of --cover or --field."""
    if settings.cover:
        measures = ("geoms", "spheres", "sticks_out_mm", *STANDS_OUT, "gap_mm", "gap_kept_mm", "made_s")
        links = ((f"{row['gripper']}: {row['part']}", *map(row.get, measures)) for row in table)
        yield shown("grippers in spheres: geoms out of spheres, spheres out of geoms", ("part", *measures), links)
        return
    if settings.field:
        nearest = [rows.rows[-1] for _, rows in table.groups("scene")]
        figures = ("free_mm", *map(strength_column, DRAWN), "sigma_mm")
        rows_of = ((row["scene"], *map(row.get, figures)) for row in nearest)
        yield shown("contact distances, and distances at which R2 begins to resist", ("scene", *figures), rows_of)
        return
    figures = ("looks", "distances", "late", "earliest_mm", "latest_mm", "p999_mm", "grazes", "out_of_band")
    found = ((" ".join(filter(None, (row["scene"], row["sticks_of"]))), *map(row.get, figures)) for row in table)
    yield shown("onset distances beside their definition: later above 0; grazes apart", ("scene", *figures), found)


def goals(settings: FeltSweep, table: Table) -> Iterator[Goal]:
    """Yield the goals: how exact onset distances must be, and how closely spheres must cover their geoms."""
    for (name,), rows in table.groups("gripper") if settings.cover else ():
        yield Goal(f"{name}: sticks out of its spheres, mm", max(rows.values("sticks_out_mm")), 0.0)
        yield Goal(f"{name}: spheres stand out, mm", max(rows.values("stands_out_mm")), _LIMIT_COVER_MM)
    if not (settings.cover or settings.field):
        yield Goal(f"onset distances later than {1e3 * LATE_M:g} mm", sum(table.values("late")), 0)
        yield Goal("onset distances of grazes out of their band", sum(table.values("out_of_band")), 0)
        yield Goal("largest D_σ off, mm", max(table.values("sigma_off_mm")), _ROUNDING_MM)


def draw(settings: FeltSweep, table: Table, path: Path) -> None:
    """Draw the figure of --cover or --field."""
    draw_cover(table, path) if settings.cover else draw_field(table, frozen(settings), path)


def frozen(settings: FeltSweep) -> str:
    """Return a hash of the frozen scenes in use; an empty text for --cover, which uses none."""
    if settings.field:
        return frozen_hash(tuple(settings.scenes()))
    return "" if settings.cover else frozen_hash()


QUESTION = Question(
    "bench felt",
    FeltSweep,
    cells,
    run,
    show,
    draw,
    goals,
    frozen=frozen,
    failed=lambda row: row.get("late", 0) + row.get("out_of_band", 0) > 0,
)
