"""Does the same simulated person hit less with haptics than without, near obstacles?

    feelahead try haptics --scenes wall slot shelf --delays 0 100 200 400 --seeds 30 --csv FILE

Everything runs in virtual time, so the same command prints the same tables. The person is simulated: nothing here is
a claim about people.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from statistics import fmean, median
from typing import Annotated

import tyro
from msgspec import Meta
from rich.table import Table as Shown

from common.emulation.clauses import LinkModel
from feelahead.both_sides.grasping_trial import MISJUDGES_DEPTH, Arm, Trial, run_trial
from feelahead.lab.approaches.laws import is_paper, require_tried
from feelahead.lab.intervals import mcnemar_p, mean_interval, share_interval
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from operator_side.people.settings import PersonSettings
from robot_side.depth.camera_settings import Perception
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.laws.named import LAWS
from robot_side.laws.paper_settings import PaperFlags

_ARMS: dict[Arm, str] = {"off": "off", "mechanical": "on, no notice taken", "reacting": "on, reacts"}
_NO_LAW = ""
"""Law of the trials without haptics"""

_JITTER_MS = 10.0
"""Standard deviation of all delays but 0"""

# Beyond a loop age of two seconds the robot side is never armed.
_Delay = Annotated[float, Meta(ge=0.0, lt=1000.0)]


@dataclass(frozen=True)
class HapticsSettings(PaperFlags, Sweep):
    """Compare a simulated person's trials without haptics, with ignored haptics, and with haptics they react to.

    The person misjudges distances and sees no obstacle. They reach for the target in single moves, grasp it, lift it
    and set it down again. Trials with the same seed have the same scene, camera errors, link and misjudged distances.
    """

    seeds: Annotated[int, Meta(ge=1), tyro.conf.arg(metavar="N")] = 30
    """Number of seeds; each gives one trial for each condition."""
    law: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME|FILE.py...")] = ("swept",)
    """Laws to compare: swept, paper, paper-isotropic, or files of your own (docs/python.md)."""
    arms: tuple[Arm, ...] = ("mechanical", "reacting")
    """Conditions beside off: mechanical, in which the person takes no notice of the triggers, and reacting."""
    scenes: tuple[SceneName, ...] = ("wall", "slot", "shelf")
    """Scenes. wall: a wall behind the target. slot: two posts on the way. shelf: a raised edge on the way. table:
    clutter beside the way."""
    delays: Annotated[tuple[_Delay, ...], tyro.conf.arg(metavar="MS...")] = (0.0, 100.0, 200.0, 400.0)
    """Delays in each direction, in milliseconds."""
    camera_mm: Annotated[float, Meta(ge=0.0, le=1000.0), tyro.conf.arg(metavar="MM")] = 3.0
    """Standard deviation of the camera's error along each axis; the law uses the same value."""
    probability: Annotated[float, Meta(gt=0.0, lt=1.0), tyro.conf.arg(metavar="P")] = 0.99
    """Probability P of the law (eq. 10)."""
    link_model: LinkModel = "datagram"
    """datagram: messages may be lost and reordered. stream: messages stay in order and losses delay them."""
    perception: Annotated[Perception, tyro.conf.arg(metavar="{objects,depth}")] = "objects"
    """What is perceived: the objects themselves, with the camera's error, or surfaces that two depth cameras see."""
    duration: Annotated[float, Meta(gt=0.0, lt=1e4), tyro.conf.arg(metavar="SECONDS")] = 45.0
    """Maximum duration of each trial, in virtual time."""
    person: Annotated[PersonSettings, tyro.conf.Suppress] = field(default_factory=lambda: MISJUDGES_DEPTH)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_tried(self.law, "law", tuple(LAWS))
        for name in ("arms", "scenes", "delays"):
            values = getattr(self, name)
            if not values or len(set(values)) < len(values):
                raise ValueError(
                    f"--{name} {' '.join(map(str, values))}: a value is missing or given twice; valid: one value or"
                    " more, each once"
                )


@dataclass(frozen=True)
class Cell:
    """One condition (arm of the experiment) in one scene with one delay."""

    scene: SceneName
    delay_ms: float
    arm: Arm
    law: str
    """Law of a trial with haptics; empty without"""
    trial: Trial


def cells(settings: HapticsSettings) -> Iterator[Cell]:
    """Yield each combination of scene, delay, condition and, with haptics, law."""
    few = 1 if settings.quick else None
    for scene, delay_ms, (arm, law) in product(settings.scenes[:few], settings.delays[:few], _conditions(settings)):
        yield Cell(
            scene,
            delay_ms,
            arm,
            law,
            Trial(
                scene,
                f"delay {delay_ms:g}ms {_JITTER_MS:g}ms distribution normal" if delay_ms else "",
                arm,
                settings.person,
                settings.duration,
                settings.link_model,
                camera_sd_m=1e-3 * settings.camera_mm,
                probability=settings.probability,
                law=law,
                paper=settings.paper,
                # Without haptics nothing is made of what is perceived.
                by_depth=settings.perception == "depth" and arm != "off",
            ),
        )


def _conditions(settings: HapticsSettings) -> list[tuple[Arm, str]]:
    both = [("off", _NO_LAW), *((arm, law) for law in settings.law for arm in _ARMS if arm != "off")]
    return [(arm, law) for arm, law in both if arm in ("off", *settings.arms)]


def run(cell: Cell, seed: int) -> Iterator[Row]:
    """Run one trial."""
    yield run_trial(cell.trial, seed)


def show(settings: HapticsSettings, table: Table) -> Iterator[Shown]:
    """Yield a table for each scene and delay, with a row for each condition."""
    for (scene, delay_ms), pairs in table.groups("scene", "delay_ms"):
        title = f"{scene}, {delay_ms:g} ms each way, {settings.seeds} pairs"
        hits = "trials with a hit [95 %]", "p", "hits", "mm/s, median (most)", "grasped", "placed"
        headings = ("haptics", *hits, "felt first", "R2 full", "finished, s", "longer by [95 %]")
        entries = []
        for arm, law in _conditions(settings):
            words = f"{law} ({settings.paper}): {_ARMS[arm]}" if is_paper(law) else _ARMS[arm]
            if len(settings.law) > 1 and law and not is_paper(law):
                words = f"{law}: {words}"
            entries.append((words, *_figures(pairs, arm, law, settings.duration)))
        yield shown(title, headings, entries)


def _figures(pairs: Table, arm: Arm, law: str, limit_s: float) -> list[str]:
    """Return the entries of one condition's row, compared with the trials of the same seeds without haptics."""
    off = {row["seed"]: row for row in pairs.where(arm="off")}
    those = [row for row in pairs.where(arm=arm, law=law) if row["seed"] in off]
    if not those:
        return []
    hit = [row["hits"] > 0 for row in those]
    low, high = share_interval(sum(hit), len(hit))
    speeds = [row["fastest_hit_mm_s"] for row in those if row["fastest_hit_mm_s"] is not None]
    times = restricted([row["finished_s"] for row in those], limit_s)
    p = longer = ""
    if arm != "off":
        beside = [off[row["seed"]] for row in those]
        p = f"{mcnemar_p([row['hits'] > 0 for row in beside], hit):.2g}"
        times_off = restricted([row["finished_s"] for row in beside], limit_s)
        differences = [time - other for time, other in zip(times, times_off, strict=True)]
        longer = "{:+.1f} [{:+.1f}, {:+.1f}]".format(fmean(differences), *mean_interval(differences))
    placed = [row for row in those if row["placed"]]
    return [
        f"{sum(hit)}/{len(hit)} [{100 * low:.0f} to {100 * high:.0f} %]",
        p,
        str(sum(row["hits"] for row in those)),
        f"{median(speeds):.0f} ({max(speeds):.0f})" if speeds else "",
        str(sum(row["grasped"] for row in those)),
        str(len(placed)),
        str(sum(row["felt_before_s"] is not None for row in placed)),
        f"{fmean(shares):.0%}" if (shares := Table(those).values("full_share")) else "",
        f"{fmean(times):.1f}",
        longer,
    ]


def restricted(times_s: Sequence[float | None], limit_s: float) -> list[float]:
    """Return the times, with the limit for longer and for missing ones; their mean is the restricted mean."""
    return [limit_s if time_s is None else min(time_s, limit_s) for time_s in times_s]


QUESTION = Question("try haptics", HapticsSettings, cells, run, show)
