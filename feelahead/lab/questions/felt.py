"""How exact are the law's onset distances and the shared volume, and how closely do spheres cover a gripper?

feelahead bench felt
feelahead bench felt --cover
feelahead bench felt --shared
feelahead bench felt --tiles
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro
from msgspec import Meta
from rich.table import Table as Shown

from common.files.input_file import require_input_file
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, PASSED, frozen_hash, scene_names
from feelahead.lab.approaches.ticks import DEMO, record
from feelahead.lab.cover import STANDS_OUT, Gripper, draw_cover, measure_cover
from feelahead.lab.goals import Goal
from feelahead.lab.reference.looks import LATE_M, compare, looks_of
from feelahead.lab.shared import FIGURES, Shared, measure_shared, shared_cells
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.lab.tiled import Tiled, measure_tiled, show_tiled, tiled_cells
from feelahead.printing.figures import shown
from robot_side.settings import RobotSettings

_LIMIT_COVER_MM: Final = 1e3 * RobotSettings().cover_m
_ROUNDING_MM: Final = 1e-9
_QUICK_POINTS: Final = 10_000
_PULLED_ASIDE: Final = ("rod_5mm", "ball", "slot", "mug", "u_mesh", "terrain_ahead", "cluttered")


@dataclass(frozen=True)
class FeltSweep(Sweep):
    """Compare the onset distances of looks, in the demo and in all frozen scenes, with their definition."""

    cover: bool = False
    """Do this instead: measure how closely spheres cover grippers, of the built-in arm and of --model."""
    shared: bool = False
    """Do this instead: compare the volume that the inflated gripper shares with a thing with voxels, in 20 poses."""
    tiles: bool = False
    """Do this instead: compare walls in tiles, as in a map, with the same walls whole: onset distances, clearances."""
    model: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE.xml...")] = ()
    """For --cover: MJCF files, each with an arm."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """For --cover: name of the site between the fingertips, whose z axis is the approach."""
    points: Annotated[int, Meta(ge=100, le=10_000_000), tyro.conf.arg(metavar="N")] = 200_000
    """For --cover: number of points sampled on each of both surfaces, shared among a gripper's links."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.picture is not None and not self.cover:
            raise ValueError(f"--picture {self.picture}: errors have no figure; valid: with --cover")
        if bool(self.model) != (self.site is not None) or (self.model and not self.cover):
            raise ValueError("--model and --site are given without one another or --cover; valid: all three, or none")
        if self.shared + self.cover + self.tiles > 1:
            raise ValueError("--shared, --cover or --tiles are given together; valid: one of them")
        for model in self.model:
            require_input_file("--model", model, "an MJCF file")


@dataclass(frozen=True)
class Looked:
    """Cell whose recorded looks are compared with the definition."""

    scene: str
    duration_s: float
    most: int
    sticks_of: str = ""
    """Scene whose stick deflections are used, instead of those of the run's own scene."""


def cells(settings: FeltSweep) -> Iterator[Looked | Gripper | Shared | Tiled]:
    """Yield the cells that the flags choose: looks, grippers, poses, or walls."""
    if settings.cover:
        points = min(settings.points, _QUICK_POINTS) if settings.quick else settings.points
        yield Gripper("built-in", None, None, points)
        for model, name in scene_names(settings.model).items():
            yield Gripper(name, model, settings.site, points)
    elif settings.shared:
        yield from shared_cells(quick=settings.quick)
    elif settings.tiles:
        yield from tiled_cells(quick=settings.quick)
    else:
        yield Looked(DEMO, 6.0, 200) if settings.quick else Looked(DEMO, 20.0, 2000)
        for scene in ("mug",) if settings.quick else (*AHEAD, *ASIDE, *PASSED):
            yield Looked(scene, 2.0 if settings.quick else 4.0, 40)
            for aside in () if settings.quick or scene not in _PULLED_ASIDE else ASIDE:
                yield Looked(scene, 3.0, 40, aside)


def run(cell: Looked | Gripper | Shared | Tiled, seed: int) -> Iterator[Row]:
    """Run one cell: yield a row of errors of a recorded run's looks, or the rows of --cover, --shared or --tiles."""
    if isinstance(cell, Looked):
        recorded = record(cell.scene, cell.duration_s, seed, ASIDE.get(cell.sticks_of))
        yield dict(compare(*looks_of(recorded, cell.most)).row())
    elif isinstance(cell, Shared):
        yield from measure_shared(cell, seed)
    elif isinstance(cell, Tiled):
        yield from measure_tiled(cell)
    else:
        yield from measure_cover(cell, seed)


def show(settings: FeltSweep, table: Table) -> Iterator[Shown]:
    """Yield the table of errors, or those of --cover, --shared or --tiles."""
    if settings.tiles:
        yield from show_tiled(table)
        return
    if settings.shared:
        poses = ((f"{row['thing']}, D {row['inflated_mm']:g} mm", *map(row.get, FIGURES)) for row in table)
        yield shown("volume shared with the inflated gripper, beside voxels; Σ V_ij; a look", ("pose", *FIGURES), poses)
        return
    if settings.cover:
        measures = ("geoms", "spheres", "sticks_out_mm", *STANDS_OUT, "gap_mm", "gap_kept_mm", "made_s")
        links = ((f"{row['gripper']}: {row['part']}", *map(row.get, measures)) for row in table)
        yield shown("grippers in spheres: geoms out of spheres, spheres out of geoms", ("part", *measures), links)
        return
    figures = ("looks", "distances", "late", "earliest_mm", "latest_mm", "p999_mm", "grazes", "out_of_band")
    found = ((" ".join(filter(None, (row["scene"], row["sticks_of"]))), *map(row.get, figures)) for row in table)
    yield shown("onset distances beside their definition: later above 0; grazes apart", ("scene", *figures), found)


def goals(settings: FeltSweep, table: Table) -> Iterator[Goal]:
    """Yield the goals: how exact distances and volumes must be, and how closely spheres must cover their geoms."""
    if settings.shared:
        allowed = [abs(row["off_mm3"]) / max(100.0, 0.01 * row["volume_mm3"]) for row in table]
        yield Goal("shared volume off, as a share of 1 % or 100 mm³, whichever is more", max(allowed), 1.0)
        return
    if settings.tiles:
        surfaces = Table(row for row in table.where(scene="ahead") if row["as"] == "surface")
        yield Goal(
            "full strength before a surface, later than before it whole, mm", max(surfaces.values("o8_most_mm")), 1.0
        )
        strict = [row["free_mm"] for row in table if row["camera_sd_m"] == 1e-3 and "free_mm" in row]
        yield Goal("σ_c 1 mm: clearance without an alarm, mm", max(strict), 12.0)
        return
    for (name,), rows in table.groups("gripper") if settings.cover else ():
        yield Goal(f"{name}: sticks out of its spheres, mm", max(rows.values("sticks_out_mm")), 0.0)
        yield Goal(f"{name}: spheres stand out, mm", max(rows.values("stands_out_mm")), _LIMIT_COVER_MM)
    if not settings.cover:
        yield Goal(f"onset distances later than {1e3 * LATE_M:g} mm", sum(table.values("late")), 0)
        yield Goal("onset distances of grazes out of their band", sum(table.values("out_of_band")), 0)
        yield Goal("largest D_σ off, mm", max(table.values("sigma_off_mm")), _ROUNDING_MM)


QUESTION = Question(
    "bench felt",
    FeltSweep,
    cells,
    run,
    show,
    lambda _, table, path: draw_cover(table, path),
    goals,
    frozen=lambda settings: "" if settings.cover or settings.shared or settings.tiles else frozen_hash(),
    failed=lambda row: row.get("late", 0) + row.get("out_of_band", 0) > 0,
)
