"""How much run time does each step to a smaller error cost, from the pose to δ, and what do peers need?

feelahead bench accuracy --quick
feelahead bench accuracy --peer-header overlap-0.2.0/include/overlap/overlap.hpp --picture accuracy.png
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import tyro
from rich.table import Table as Shown

from common.files.input_file import require_input_file
from feelahead.lab.accuracy import displacement, distance_peers, onset, pose, volume
from feelahead.lab.accuracy.picture import draw_points
from feelahead.lab.accuracy.placements import placements
from feelahead.lab.accuracy.points import pooled
from feelahead.lab.approaches.frozen import frozen_hash
from feelahead.lab.approaches.pulls import PullKind
from feelahead.lab.reference.published import SDIST, CompiledHeader
from feelahead.lab.sweep import Question, Sweep, generator
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import short, shown

SCENES: Final = ("wall", "ball", "post", "cluttered", "mug")
QUICK_SCENES: Final = ("wall", "ball")
DELAYS_MS: Final = (50, 200)


@dataclass(frozen=True)
class AccuracySweep(Sweep):
    """Measure run time and error of each part of the chain, for the settings that trade one for the other.

    Parts: distances that looks find, volumes of overlaps, the gripper's pose, δ, and turns. Peers get the same inputs
    in the same run: MuJoCo's and coal's distances, a distance grid, the published package `overlap`, Monte Carlo and
    voxels. Times are processor times: medians of short chunks that take turns. A point is off the front if another one
    of its part and unit is both faster and more accurate. coal is optional: pip install coal. The C++ package is as in:
    feelahead bench overlap --help.
    """

    peer_header: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """overlap.hpp of the package's source distribution, for its row."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.peer_header is not None:
            require_input_file("--peer-header", self.peer_header, f"overlap.hpp, from: {SDIST}")


@dataclass(frozen=True)
class Cell:
    """Cell: one scene, class of pairs or delay; `count` cases, chunks of time `rounds`, `seconds` of virtual time."""

    what: Literal["looks", "paths", "volume", "pose", "delta", "turns"]
    case: str
    solid: str
    count: int
    rounds: int
    seconds: float = 0.0
    header: str | None = None


def cells(settings: AccuracySweep) -> Iterator[Cell]:
    """Yield the cells, in the order of the chain."""
    quick, rounds = settings.quick, (5 if settings.quick else 21)
    header = None if settings.peer_header is None else str(settings.peer_header)
    for scene in QUICK_SCENES if quick else SCENES:
        yield Cell("looks", scene, "", 3 if quick else 20, rounds)
        yield Cell("paths", scene, "", 3 if quick else 20, rounds)
    for case in volume.CLASSES:
        for solid in ("box",) if quick else ("box", "tetrahedron"):
            yield Cell("volume", case, solid, 6 if quick else 40, 3 if quick else 7, header=header)
    yield Cell("pose", "wall", "", 20 if quick else 500, rounds, 1.0 if quick else 10.0)
    for delay_ms in DELAYS_MS:
        yield Cell("delta", str(delay_ms), "", 2 if quick else 5, rounds, 1.0 if quick else 4.0)
    for delay_ms in DELAYS_MS[:1] if quick else DELAYS_MS:
        yield Cell("turns", str(delay_ms), "", 1, 1, 5.0 if quick else 6.0)


_PULLS: Final[tuple[PullKind, ...]] = ("bell", "random", "on_off", "steady", "swerve")


def run(cell: Cell, seed: int) -> Iterator[Row]:
    """Measure one cell; yield a row for each point, and one for each peer that is missing."""
    random = generator(cell, seed)
    match cell.what:
        case "looks":
            there = placements(cell.case, cell.count, random)
            yield from onset.measure(there, cell.rounds, distance_peers.peers(there))
            if missing := distance_peers.coal_missing():
                yield {"missing": missing}
        case "paths":
            yield from onset.measure_paths(placements(cell.case, cell.count, random), cell.rounds)
        case "volume":
            header = _header(cell.header)
            yield from volume.measure(cell.solid, cell.case, cell.count, cell.rounds, header, seed)
            if header.missing:
                yield {"missing": f"{volume.HEADER}: {header.missing}"}
        case "pose":
            yield from pose.measure(cell.count, cell.seconds, cell.rounds, random)
        case "delta":
            yield from displacement.measure(int(cell.case), _PULLS[: cell.count], cell.seconds, cell.rounds, seed)
        case "turns":
            yield from displacement.measure_turns(int(cell.case), cell.seconds, seed)


@functools.cache
def _header(path: str | None) -> CompiledHeader:
    return CompiledHeader(None if path is None else Path(path))


def show(_: AccuracySweep, table: Table) -> Iterator[Shown | str]:
    """Yield one table of all points, then the peers that are missing."""
    columns = (
        "part",
        "knob",
        "setting",
        "time, us",
        "of *",
        "worst",
        "p95",
        "unit",
        "reference",
        "on the front",
    )
    yield shown("Run time against error; * is built in", columns, (line(row) for row in pooled(table)))
    yield from dict.fromkeys(f"not measured: {missing}" for missing in table.values("missing"))


def line(row: Row) -> tuple[str | float | None, ...]:
    """Return the entries of a point's row."""
    setting = f"{row['setting']} *" if row["built"] else row["setting"]
    front = "yes" if row["beaten_by"] is None else f"no: {row['beaten_by']}"
    errors = (f"{row[name]:.2g}" if row[name] < 0.01 else short(row[name]) for name in ("worst", "p95"))
    return row["part"], row["knob"], setting, row["us"], row["of_built"], *errors, row["unit"], row["reference"], front


QUESTION = Question(
    "bench accuracy",
    AccuracySweep,
    cells,
    run,
    show,
    lambda _, table, path: draw_points(pooled(table), path),
    frozen=lambda _: frozen_hash(),
    timed=True,
)
