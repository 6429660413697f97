"""How often does full strength come in time, and how often without need, for each law?

feelahead bench coverage --quick --laws swept none
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro
from msgspec import Meta
from rich.console import RenderableType
from rich.table import Table as Shown

from feelahead.lab.approaches.approach import compile_kernels
from feelahead.lab.approaches.coverage_cells import depth_cells, full_cells, quick_cells
from feelahead.lab.approaches.evaluation import LINKS, Placement, Pulls, evaluate
from feelahead.lab.approaches.frozen import frozen_hash
from feelahead.lab.approaches.laws import TriedLaw, is_paper, require_tried
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from feelahead.printing.pictures import colour_of, figure
from robot_side.depth.camera_settings import Perception
from robot_side.laws.paper_settings import PaperFlags

HOMES: Final = {"u_mesh": "mug", "mug": "mug"}
"""Scenes whose home pose differs from that of `empty`, with the scene in which their approaches are recorded."""
COMPARED: Final = ("swept", "swept_robot", "paper", "none", "full")
QUICK_SIZES: Final = (10, 4)
"""Number of approaches of each motion, and of placements of the objects for each, with --quick."""
QUICK_JUDGED_S, JUDGED_S = 60.0, 600.0
"""Minimum time judged for false alarms, in seconds, over all cells of one kind of motion; by depth, for each cell."""
_MARKS: Final = ("o", "s", "^", "D")
_CELL: Final = ("scene", "seen_by", "pull", "link", "camera_mm", "encoder_factor", "probability")
_Probability = Annotated[float, Meta(gt=0.0, le=0.9999)]
"""Probability P; the greatest takes 100 000 draws for each cell."""


@dataclass(frozen=True)
class CoverageSettings(PaperFlags, Sweep):
    """Measure the share of approaches with full strength in time, and false alarms, for each law.

    Covered: full strength came in time. That is, 0.25 s before the last release that avoids the contact, the farthest
    zone that the trigger had reached by then was at full strength. False alarm: strength of 4 or more under the
    finger, although the gripper, pulled to this zone and then stopped, would keep D_σ(P) + 15 mm from all objects,
    whether the sticks continue or end.
    Pulls are recorded over the emulated link without haptics, and judged for every scene, camera error, law and P.
    --quick: a few cells in three minutes, instead of all in two hours.
    """

    laws: Annotated[tuple[TriedLaw, ...], tyro.conf.arg(metavar="NAME|FILE.py...")] = COMPARED
    """Laws to compare: swept, swept_robot (the robot side compensates the delay), paper, paper-isotropic (as it
    is printed), none, full (always the strongest effect), or files of your own."""
    probabilities: Annotated[tuple[_Probability, ...], tyro.conf.arg(metavar="P...")] = ()
    """Judge only these P, instead of those planned for each cell; each takes n >= 10/(1 - P) draws for each cell."""
    perception: Annotated[Perception, tyro.conf.arg(metavar="{objects,depth}")] = "objects"
    """What is perceived: the objects themselves, with the camera's error, or surfaces that depth cameras see."""
    only: Annotated[tuple[str, ...], tyro.conf.arg(metavar="TEXT...")] = ()
    """Judge only cells whose name, such as 'wall/bell/200 ms', contains one of these texts. With --perception depth
    and --quick, too, these are chosen among all cells."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_tried(self.laws, "laws")
        if not any(pulls.cells for pulls in self.pulls()):
            raise ValueError(
                f"--only {' '.join(self.only)}: no cell's name contains it; valid: a part of a cell's name, such as"
                " wall/bell/200 ms"
            )

    def pulls(self) -> list[Pulls]:
        """Return the motions with their chosen cells; motions with the most cells come first."""
        found: dict[tuple[PullKind, str, str, str], list[Placement]] = {}
        for pull, link, cell in self._cells():
            if not self.only or any(text in cell.key(pull, link) for text in self.only):
                # Pictures take minutes a cell: each is then kept as soon as it is judged.
                alone = cell.key(pull, link) if self.perception == "depth" else ""
                mine = found.setdefault((pull, link, HOMES.get(cell.scene, "empty"), alone), [])
                mine += [cell] if cell not in mine else []
        sizes = QUICK_SIZES if self.quick else (25, 8)
        probabilities = (0.5, 0.9) if self.quick else (0.5, 0.9, 0.99, 0.999)
        chosen = tuple(sorted(set(self.probabilities))) or probabilities
        judged_s = QUICK_JUDGED_S if self.quick else JUDGED_S
        of_kind = Counter((pull, link, alone) for (pull, link, _, alone), cells in found.items() for _ in cells)
        motions = [
            Pulls(
                *(pull, link, home, tuple(cells), sizes, chosen, self.laws, (self.paper,)),
                judged_s=judged_s / of_kind[pull, link, alone],
            )
            for (pull, link, home, alone), cells in found.items()
        ]
        return sorted(motions, key=lambda pulls: -len(pulls.cells))

    def _cells(self) -> Iterator[tuple[PullKind, str, Placement]]:
        if self.perception == "depth":
            return depth_cells(quick=self.quick and not self.only)
        return quick_cells() if self.quick else full_cells()


def cells(settings: CoverageSettings) -> Sequence[Pulls]:
    """Return the cells: motions to record and judge."""
    return settings.pulls()


def run(cell: Pulls, seed: int) -> Iterator[Row]:
    """Record one motion and judge its cells."""
    yield from evaluate(cell, seed)


def show(settings: CoverageSettings, table: Table) -> Iterator[RenderableType]:
    """Yield tables by cell, by pull and by law."""
    found = judged(table)
    yield _by_cell(
        found, settings.laws, "covered: full strength stood in time, share [95 %], * where it holds", _covered
    )
    yield _by_cell(found, settings.laws, "false alarms a minute (share of the time in which R2 is pulled)", _alarms)
    yield "n: draws (approaches). apart: places in which no release avoids the contact / that are judged before the"
    yield "sticks move once more, so that nobody can know / that were not found"
    yield from (by_pull(found, law) for law in settings.laws)
    yield by_law(table, settings.laws)
    if any(map(is_paper, settings.laws)):
        yield f"paper: {settings.paper}"


def judged(table: Table) -> Table:
    """Return the rows sorted by cell."""
    return Table(sorted(table, key=lambda row: row["cell"]))


def _by_cell(found: Table, laws: Sequence[str], title: str, entry: Callable[[Row], str]) -> Shown:
    rows = []
    for (scene, seen_by, pull, link, camera_mm, encoders, probability), of_cell in found.groups(*_CELL):
        some, entries = of_cell.rows[0], [entry(row) for law in laws for row in of_cell.where(law=law)]
        if any(entries):
            camera = f"{camera_mm:g} mm{f', encoders x{encoders:g}' if encoders != 1.0 else ''}"
            count = (
                f"{some['draws']} ({some['approaches']})",
                " / ".join(str(some[name]) for name in ("unavoidable", "unknowable", "not_found")),
            )
            rows.append((scene, seen_by, pull, link, camera, probability, *count, some["judged_s"] / 60.0, *entries))
    return shown(title, ("scene", "seen by", "pull", "link", "camera", "P", "n", "apart", "minutes", *laws), rows)


def _covered(row: Row) -> str:
    if row["coverage"] is None:
        return "none avoidable" if row["places"] + row["not_found"] else ""
    return f"{row['coverage']:.3f} [{row['low']:.2f} to {row['high']:.2f}]{'*' if row['holds'] else ''}"


def _alarms(row: Row) -> str:
    rate = row["alarms_per_min"]
    return "" if rate is None else f"{rate:.1f} ({100 * row['alarm_share']:.1f} %)"


def by_pull(found: Table, law: str) -> Shown:
    """Return a table in Markdown, for docs/feel.md: a row for each pull, link and P, over all scenes and errors."""
    order = PULL_KINDS.index, list(LINKS).index
    mine = sorted(found.where(law=law), key=lambda row: (order[0](row["pull"]), order[1](row["link"])))
    entries = []
    for key, rows in Table(mine).groups("pull", "link", "probability"):
        known, pulled = rows.values("coverage"), rows.values("alarms_per_min")
        least = _where(rows, "coverage", min(known), ".3f") if known else ""
        most = _where(rows, "alarms_per_min", max(pulled), ".1f") if pulled else ""
        means = mean(rows, "coverage"), least, *pooled_alarms(rows), most
        minutes = f"{sum(rows.values('judged_s')) / 60.0:.1f}"
        entries.append((*map(str, key), f"{sum(rows.values('holds'))} of {len(known)}", *means, minutes))
    headings = ("pull", "link", "P", "cells that hold", "covered", "least")
    alarms = ("false alarms a minute", "share", "most a minute", "minutes judged")
    return shown(f"{law}, by pull and link", (*headings, *alarms), entries)


def _where(rows: Table, name: str, value: float, form: str) -> str:
    return f"{value:{form}} ({rows.where(**{name: value}).rows[0]['scene']})"


def by_law(table: Table, laws: Sequence[str]) -> Shown:
    """Return a table with a row for each law and P, over all cells."""
    found = judged(table)
    entries = [
        (
            *(law, f"{probability:g}", f"{sum(rows.values('holds'))} of {len(rows.values('coverage'))}"),
            mean(rows, "coverage"),
            *pooled_alarms(rows),
        )
        for law in laws
        for (probability,), rows in found.where(law=law).groups("probability")
    ]
    headings = ("law", "P", "cells that hold", "covered")
    title = "the laws side by side, means over the cells, alarms over all their time"
    return shown(title, (*headings, "false alarms a minute", "share"), entries)


def mean(rows: Table, name: str, form: str = ".3f") -> str:
    """Return the mean of the figures in a column as text; an empty text without figures."""
    values = rows.values(name)
    return format(sum(values) / len(values), form) if values else ""


def pooled_alarms(rows: Table) -> tuple[str, str]:
    """Return false alarms a minute and their share of the judged time, as texts; empty texts if nothing was judged."""
    number, alarm_s, judged_s = (sum(rows.values(name)) for name in ("alarms", "alarm_s", "judged_s"))
    return (f"{60.0 * number / judged_s:.2f}", f"{alarm_s / judged_s:.2%}") if judged_s else ("", "")


def draw(settings: CoverageSettings, table: Table, path: Path) -> None:
    """Draw coverage against false alarms: a point for each law and P, at the means over the cells."""
    table = judged(table)
    marks = dict(zip(sorted(set(table.values("probability"))), _MARKS, strict=False))
    with figure(path, figsize=(7.2, 4.6)) as (_, axes):
        for law in settings.laws:
            colour = colour_of(law, settings.laws)
            axes.plot([], [], color=colour, linewidth=4.0, label=law)
            points = []
            for probability, mark in marks.items():
                rows = table.where(law=law, probability=probability)
                (alarms, _), covered = pooled_alarms(rows), mean(rows, "coverage", ".17g")
                if alarms and covered:
                    points.append((float(alarms), float(covered)))
                    axes.plot(*points[-1], mark, color=colour, alpha=0.8)
            axes.plot([x for x, _ in points], [y for _, y in points], color=colour, linewidth=0.8)
        for probability, mark in marks.items():
            axes.plot([], [], mark, color="black", label=f"P = {probability:g}")
        axes.set(xlabel="false alarms a minute", ylabel="covered: full strength in time", ylim=(-0.03, 1.03))
        axes.set_xscale("symlog", linthresh=0.1)
        axes.set_xlim(-0.02, 200.0)
        axes.grid(alpha=0.3)
        axes.legend(loc="center", fontsize=8)
        of_paper = f"; paper: {settings.paper}" if any(map(is_paper, settings.laws)) else ""
        axes.set_title(f"all cells together (frozen {frozen_hash()}{of_paper})", fontsize=9)


QUESTION = Question(
    "bench coverage",
    CoverageSettings,
    cells,
    run,
    show,
    draw=draw,
    frozen=lambda _: frozen_hash(),
    prepare=compile_kernels,
)
