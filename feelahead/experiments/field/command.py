"""Look ahead at things that stand at known distances, and say where each strength begins and what that took."""

import math
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from common.command.command_line import parse_settings
from common.files.input_file import require_input_file
from common.files.output_file import require_output_file, write_json
from feelahead.experiments.field.looking import Look, Looker
from feelahead.experiments.field.picture import draw
from feelahead.lab.approaches.frozen import SITE, frozen_hash, frozen_scene, scene_names
from feelahead.lab.figures import PICTURES
from feelahead.lab.progress import progress

_PROGRAM = "feelahead try field"
_CONVEX = ("wall", "plate", "ball", "post", "rod_10mm", "rod_5mm", "rod_2mm", "wall_45")
_SHOWN_MM = 80.0
_SHOWN_STRENGTHS = (1, 4, 8)


@dataclass(frozen=True)
class FieldSettings:
    """How far ahead of things the strengths of R2 begin, in the scene's home pose, without camera error.

    The objects are moved along the approach until the gripper's true free way is as asked. Each strength should begin
    as far from every thing: at D_σ and the cover's 3 mm for the eighth, up to 12 mm earlier for the first. Beside it
    stands the processor time of one look, the median of many, along R2 and along L2.
    """

    model: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE.xml...")] = ()
    """MJCF scenes with an arm; the frozen ones with one convex thing ahead unless given."""
    site: Annotated[str, tyro.conf.arg(metavar="NAME")] = SITE
    """The site between the fingertips, z along the approach."""
    probability: Annotated[float, tyro.conf.arg(metavar="P")] = 0.99
    """P of eq. 10."""
    step_mm: Annotated[float, tyro.conf.arg(metavar="MM")] = 10.0
    """Free ways from 0 to 150 mm in such steps."""
    looks: Annotated[int, tyro.conf.arg(metavar="N")] = 200
    """How many looks are timed."""
    summary: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write every figure there."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Draw where strengths begin against the free way."""

    def __post_init__(self) -> None:
        if not 0.0 < self.probability < 1.0:
            raise ValueError(f"--probability {self.probability}: valid: above 0 and below 1")
        if not 1.0 <= self.step_mm <= 150.0:
            raise ValueError(f"--step-mm {self.step_mm}: valid: 1 to 150")
        if not 1 <= self.looks <= 100_000:
            raise ValueError(f"--looks {self.looks}: valid: 1 to 100000")
        for model in self.model:
            require_input_file("--model", model, "an MJCF file")
        require_output_file("--summary", self.summary)
        require_output_file("--picture", self.picture, PICTURES)


def try_field(arguments: Sequence[str]) -> int:
    """Look, print, write the summary and the picture."""
    settings = parse_settings(FieldSettings, _PROGRAM, arguments)
    models = settings.model or tuple(frozen_scene(name) for name in _CONVEX)
    ways_mm = np.unique([*np.arange(0.0, 150.1, settings.step_mm), _SHOWN_MM])
    found: dict[str, list[Look]] = {}
    # All scenes first: one that cannot be used is named before any is timed.
    lookers = {name: Looker(model, settings.site, settings.probability) for model, name in scene_names(models).items()}
    with progress("scenes", len(models)) as advance:
        for name, looker in lookers.items():
            found[name] = [looker.look(1e-3 * way, settings.looks, time.thread_time) for way in ways_mm.tolist()]
            advance(1.0)
    frozen = frozen_hash(models)
    # Files first: whoever reads the table may leave early.
    if settings.summary is not None:
        figures = {name: [_figures(look) for look in looks] for name, looks in found.items()}
        write_json("--summary", settings.summary, {"scenes": figures, "frozen": frozen})
    if settings.picture is not None:
        draw(found, frozen, settings.picture)
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False, markup=False)
    console.print(_table(found))
    console.print(f"frozen scenes and limits: {frozen}")
    return 0


def _figures(look: Look) -> dict[str, Any]:
    return asdict(look) | {"ways_mm": [way if math.isfinite(way) else None for way in look.ways_mm]}


def _table(found: dict[str, list[Look]]) -> Table:
    table = Table(title=f"{_SHOWN_MM:g} mm before each thing: ways in mm after which R2 begins to resist")
    for heading in ("scene", *(f"strength {k}" for k in _SHOWN_STRENGTHS), "overlaps", "R2, µs", "L2, µs"):
        table.add_column(heading, justify="left" if heading == "scene" else "right")
    for name, looks in found.items():
        look = min(looks, key=lambda one: abs(one.free_mm - _SHOWN_MM))
        ways = (f"{look.ways_mm[strength - 1]:.1f}" for strength in _SHOWN_STRENGTHS)
        table.add_row(name, *ways, f"{look.overlaps}", f"{look.r2_us:.0f}", f"{look.l2_us:.0f}")
    return table
