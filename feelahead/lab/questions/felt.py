"""How long does one evaluation of the law (look) take, and how exact is it, by the number of the gripper's spheres?

feelahead bench felt --quick --picture felt.png
feelahead bench felt --definition
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
from feelahead.lab.figures import figure
from feelahead.lab.goals import Goal
from feelahead.lab.reference.looks import LATE_M, compare, looks_of
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.lab.variants import COVER_M, COVERS_M, KINDS, errors_mm, replay

_LIMIT_COVER_MM: Final = 1e3 * COVER_M
_ROUNDING_MM: Final = 1e-9
_QUICK_POINTS: Final = 10_000
_QUICK_SCENES: Final = 2
_PULLED_ASIDE: Final = ("rod_5mm", "ball", "slot", "mug", "u_mesh", "terrain_ahead", "cluttered")
_LEAST_MM: Final = 1e-3
"""Smallest error that is drawn, in mm: the axis is logarithmic."""


@dataclass(frozen=True)
class FeltSweep(Sweep):
    """Measure run time and errors of the law's onset distances, for fewer and more spheres that cover the gripper.

    All covers get the same recorded ticks, in turns, and are compared with the finest cover.
    """

    definition: bool = False
    """Do this instead: compare the onset distances of looks in the demo and in all frozen scenes with their
    definition."""
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
        asked = [f"--{name}" for name in ("definition", "cover", "field") if getattr(self, name)]
        if len(asked) > 1:
            raise ValueError(f"{' and '.join(asked)} exclude each other; valid: one of them")
        if self.definition and self.picture is not None:
            raise ValueError(
                f"--picture {self.picture}: --definition has no figure; valid: --picture without --definition"
            )
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
class Run:
    """Cell with one recorded run: the demo, or a pull of 2 N in a frozen scene."""

    run: str
    duration_s: float
    times: int = 2
    """Number of passes over the ticks; the least time of each tick counts."""


@dataclass(frozen=True)
class Looked:
    """Cell whose recorded looks are compared with the definition."""

    scene: str
    duration_s: float
    most: int
    sticks_of: str = ""
    """Scene whose stick deflections are used, instead of those of the run's own scene."""


def cells(settings: FeltSweep) -> Iterator[Run | Looked | Gripper | Facing]:
    """Yield the cells that the flags choose: recorded runs, looks, grippers, or scenes."""
    if settings.cover:
        points = min(settings.points, _QUICK_POINTS) if settings.quick else settings.points
        yield Gripper("built-in", None, None, points)
        for model, name in scene_names(settings.model).items():
            yield Gripper(name, model, settings.site, points)
    elif settings.field:
        for model, name in settings.scenes().items():
            yield Facing(name, model, settings.site or SITE, settings.step_mm)
    elif settings.definition:
        yield Looked(DEMO, 6.0, 200) if settings.quick else Looked(DEMO, 20.0, 2000)
        for scene in ("mug",) if settings.quick else (*AHEAD, *ASIDE, *PASSED):
            yield Looked(scene, 2.0 if settings.quick else 4.0, 40)
            for aside in () if settings.quick or scene not in _PULLED_ASIDE else ASIDE:
                yield Looked(scene, 3.0, 40, aside)
    else:
        yield Run(DEMO, 3.0 if settings.quick else 7.0)
        for scene in ("mug",) if settings.quick else ("wall", "mug", "u_mesh"):
            yield Run(scene, 3.0 if settings.quick else 3.5)


def run(cell: Run | Looked | Gripper | Facing, seed: int) -> Iterator[Row]:
    """Run one cell: yield a row for each cover in a recorded run, or the rows of the part that the flags choose."""
    if isinstance(cell, Looked):
        asked, encoder_sigma_rad = looks_of(
            record(cell.scene, cell.duration_s, seed, ASIDE.get(cell.sticks_of)), cell.most
        )
        yield dict(compare(asked, encoder_sigma_rad).row())
        return
    if not isinstance(cell, Run):
        yield from measure_cover(cell, seed) if isinstance(cell, Gripper) else look_ahead(cell)
        return
    recorded = record(cell.run, cell.duration_s, seed)
    covered = replay(recorded, COVERS_M, cell.times)
    for cover_m, one in zip(COVERS_M, covered, strict=True):
        apart = {kind: errors_mm(one, covered[-1], kind) for kind in KINDS}
        sizes = {f"{kind} {name}": size for kind, found in apart.items() for name, size in found.items()}
        yield {"cover_mm": 1e3 * cover_m} | one.costs() | sizes


def show(settings: FeltSweep, table: Table) -> Iterator[Shown]:
    """Yield a table of covers for each run; or with --definition, --cover or --field, the table of that."""
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
    if settings.definition:
        figures = ("looks", "distances", "late", "earliest_mm", "latest_mm", "p999_mm", "grazes", "out_of_band")
        found = ((" ".join(filter(None, (row["scene"], row["sticks_of"]))), *map(row.get, figures)) for row in table)
        yield shown("onset distances beside their definition: later above 0; grazes apart", ("scene", *figures), found)
        return
    costs = ("cover_mm", "spheres", "looks_per_s", "p50_us", "p99_us", "mean_us")
    for (name,), rows in table.groups("run"):
        title = f"{name}: processor time of the law in a tick; mm: mean, 95 % of the size, earliest to latest"
        entries = ((*(row[cost] for cost in costs), *(_apart(row, kind) for kind in KINDS)) for row in rows)
        yield shown(title, (*costs, *KINDS), entries)


def _apart(row: Row, kind: str) -> str | None:
    mean, p95, earliest, latest = (row.get(f"{kind} {name}") for name in ("mean", "p95", "earliest", "latest"))
    return None if mean is None else f"{mean:+.2f}; {p95:.2f}; {earliest:+.1f} to {latest:+.1f}"


def goals(settings: FeltSweep, table: Table) -> Iterator[Goal]:
    """Yield the goals: how exact onset distances must be, and how closely spheres must cover their geoms."""
    for (name,), rows in table.groups("gripper") if settings.cover else ():
        yield Goal(f"{name}: sticks out of its spheres, mm", max(rows.values("sticks_out_mm")), 0.0)
        yield Goal(f"{name}: spheres stand out, mm", max(rows.values("stands_out_mm")), _LIMIT_COVER_MM)
    if settings.definition:
        yield Goal(f"onset distances later than {1e3 * LATE_M:g} mm", sum(table.values("late")), 0)
        yield Goal("onset distances of grazes out of their band", sum(table.values("out_of_band")), 0)
        yield Goal("largest D_σ off, mm", max(table.values("sigma_off_mm")), _ROUNDING_MM)


def draw(settings: FeltSweep, table: Table, path: Path) -> None:
    """Draw run time against error of full strength, a line for each run; or the figure of --cover or --field."""
    if settings.cover or settings.field:
        draw_cover(table, path) if settings.cover else draw_field(table, frozen(settings), path)
        return
    with figure(path, figsize=(5.2, 3.8)) as (_, axes):
        for (name,), rows in table.groups("run"):
            sizes = [max(row.get("fast full p95", 0.0), _LEAST_MM) for row in rows]
            axes.plot(rows.values("mean_us"), sizes, "o-", label=name, markersize=3, linewidth=0.8)
            for row, size in zip(rows, sizes, strict=True):
                axes.annotate(f"{row['cover_mm']:g} mm", (row["mean_us"], size), fontsize=5)
        axes.set(xscale="log", yscale="log", xlabel="mean run time of a tick's law, µs")
        axes.set(ylabel="95 % of |full strength's onset - the finest's|, mm")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=6)


def frozen(settings: FeltSweep) -> str:
    """Return a hash of the frozen scenes that --definition and --field use; an empty text without them."""
    if settings.definition:
        return frozen_hash()
    return frozen_hash(tuple(settings.scenes())) if settings.field else ""


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
    timed=True,
)
