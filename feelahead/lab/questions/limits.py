"""Does a slower or faster arm than usual stop before contact, with its own limits known and with the usual ones?

feelahead try limits --velocity 0.5 1 2 --acceleration 2 8 20 --delay 0 200 --csv limits.csv
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Annotated, Final, Literal, get_args

import tyro
from msgspec import Meta
from rich.console import RenderableType

from feelahead.lab.approaches.approach import Approach, compile_kernels, run_approach
from feelahead.lab.approaches.frozen import frozen_hash, frozen_scene
from feelahead.lab.approaches.pulls import make_pull, no_stronger
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from operator_side.people.arming_hands import constant_force
from operator_side.people.port import Pulling
from robot_side.arm.limits import ArmLimits

Pulls = Literal["constant", "quick"]
Known = Literal["usual", "own"]
_FORCE_N: Final = 2.0
_Above = Annotated[float, Meta(gt=0.0, le=1000.0)]
_Delay = Annotated[float, Meta(ge=0.0, le=900.0)]


@dataclass(frozen=True)
class LimitsSettings(Sweep):
    """Pull R2 with at most 2 N towards a wall and a post, on simulated arms of other limits than usual.

    Each approach is run twice: the robot side assumes the usual 2 rad/s and 8 rad/s² (usual), or knows the arm's own
    limits (own). Both sides run in virtual time.
    """

    velocity: Annotated[tuple[_Above, ...], tyro.conf.arg(metavar="RAD/S...")] = (0.5, 1.0, 2.0)
    """Largest velocities of the arms' joints; with --quick the first."""
    acceleration: Annotated[tuple[_Above, ...], tyro.conf.arg(metavar="RAD/S²...")] = (2.0, 8.0, 20.0)
    """Largest accelerations; with --quick the first."""
    latency: Annotated[tuple[Annotated[float, Meta(ge=0.0, le=500.0)], ...], tyro.conf.arg(metavar="MS...")] = (0.0,)
    """Latencies of the drives, in milliseconds; with --quick the first."""
    delay: Annotated[tuple[_Delay, ...], tyro.conf.arg(metavar="MS...")] = (0.0, 100.0, 200.0)
    """Delays each way, in milliseconds; with --quick the first and the last."""
    pulls: tuple[Pulls, ...] = ("constant", "quick")
    """constant: 2 N. quick: bell-shaped pulls of 0.7 to 1.4 s, as of an aiming hand, of at most 2 N."""
    scenes: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME...")] = ("wall", "post")
    """Frozen scenes of tests/data."""
    seeds: Annotated[int, Meta(ge=1, le=1000), tyro.conf.arg(metavar="N")] = 1
    """Number of seeds."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("velocity", "acceleration", "latency", "delay", "pulls", "scenes"):
            if not getattr(self, name):
                raise ValueError(f"--{name}: no value is given; valid: one value or more")


@dataclass(frozen=True)
class Cell:
    """One approach of one arm."""

    scene: str
    pull: Pulls
    delay_ms: float
    velocity_rad_s: float
    acceleration_rad_s2: float
    latency_ms: float
    known: Known
    duration_s: float = 8.0


def cells(settings: LimitsSettings) -> Iterator[Cell]:
    """Yield a cell for each combination of the values."""
    few, ends = (1, max(len(settings.delay) - 1, 1)) if settings.quick else (None, 1)
    for scene, pull, delay_ms, velocity, acceleration, latency_ms, known in product(
        settings.scenes,
        settings.pulls,
        settings.delay[::ends],
        settings.velocity[:few],
        settings.acceleration[:few],
        settings.latency[:few],
        get_args(Known),
    ):
        # A slow arm takes longer to the wall.
        duration_s = 8.0 if velocity >= 1.0 else 16.0
        yield Cell(scene, pull, delay_ms, velocity, acceleration, latency_ms, known, duration_s)


def run(cell: Cell, seed: int) -> Iterator[Row]:
    """Run one approach; yield its end, where it stopped, and how late the robot side found the arm's stops."""
    own = ArmLimits(
        velocity_rad_s=cell.velocity_rad_s,
        acceleration_rad_s2=cell.acceleration_rad_s2,
        deceleration_rad_s2=1.5 * cell.acceleration_rad_s2,
        latency_s=1e-3 * cell.latency_ms,
    )
    approach = Approach(
        model=frozen_scene(cell.scene),
        force_n=_FORCE_N,
        link=f"delay {cell.delay_ms:g}ms" if cell.delay_ms else "",
        duration_s=cell.duration_s,
        seed=seed,
    )
    approach = replace(approach, arm_limits=own if cell.known == "own" else ArmLimits(), simulated_limits=own)
    quick = Pulling(no_stronger(make_pull("bell", seed), _FORCE_N))
    outcome = run_approach(approach, quick if cell.pull == "quick" else constant_force(_FORCE_N))
    yield {
        "end": outcome.end,
        "contact_speed_mm_s": outcome.contact_speed_mm_s,
        "stops_at_mm": outcome.stops_at_mm,
        "least_gap_mm": outcome.least_gap_mm,
        "reversals": outcome.reversals,
        "later_ms": outcome.later_ms,
        "why": outcome.why,
    }


def show(settings: LimitsSettings, table: Table) -> Iterator[RenderableType]:
    """Yield a table with a row for each arm and link, and a sentence that counts the contacts."""
    columns = [(pull, known) for pull in settings.pulls for known in ("usual", "own")]
    names = ("velocity_rad_s", "acceleration_rad_s2", "latency_ms", "delay_ms")
    entries = [
        (
            *(f"{value:g}" for value in values),
            *(_ends(rows.where(pull=pull, known=known).rows) for pull, known in columns),
        )
        for values, rows in table.groups(*names)
    ]
    headings = ("rad/s", "rad/s²", "latency, ms", "delay, ms", *(f"{pull}, {known}" for pull, known in columns))
    yield shown("contacts of approaches at 2 N, and least gap left in mm", headings, entries)
    counts = [
        f"{known} limits: {sum(row['end'] == 'contact' for row in rows)} contacts of {len(rows)}"
        for known in ("usual", "own")
        if (rows := table.where(known=known).rows)
    ]
    yield "; ".join(counts)


def _ends(rows: Sequence[Row]) -> str:
    if not rows:
        return ""
    contacts = [row["contact_speed_mm_s"] for row in rows if row["end"] == "contact"]
    parts = [f"{len(contacts)}/{len(rows)} at {max(contacts):.0f} mm/s"] if contacts else []
    gaps = [row["least_gap_mm"] for row in rows if row["end"] in ("stopped", "undecided")]
    parts += [f"{min(gaps):.1f}"] if gaps else []
    parts += [f"{row['end']}: {row['why']}" for row in rows if row["end"] in ("disarmed", "failed")]
    return ", ".join(parts)


QUESTION = Question(
    "try limits",
    LimitsSettings,
    cells,
    run,
    show,
    frozen=lambda settings: frozen_hash([frozen_scene(name) for name in settings.scenes]),
    failed=lambda row: row["end"] in ("disarmed", "failed"),
    prepare=compile_kernels,
)
