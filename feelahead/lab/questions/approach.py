"""Does a finger that pulls with constant force hit the objects ahead, how fast, or where does the gripper stop?

feelahead try approach --model tests/data/wall.xml --force 2 3 --law swept none --link "" "delay 200ms"
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from statistics import median
from typing import Annotated, Final

import tyro
from msgspec import Meta
from rich.console import RenderableType
from rich.table import Table as Shown
from rich.text import Text

from common.command.run_options import TickPeriod, tick_period_s
from common.emulation.clauses import LinkModel
from common.files.input_file import require_input_file
from common.periods import TURN
from common.protocol.messages import Compensation, Vector2
from feelahead.lab.approaches.approach import Approach, compile_kernels, run_approach
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, GRIPPED, SCENES, SITE, frozen_hash, frozen_scene, scene_names
from feelahead.lab.approaches.laws import (
    TriedLaw,
    compensation_of,
    is_paper,
    paper_figures,
    require_tried,
    with_compensation,
    without_compensation,
)
from feelahead.lab.approaches.links import require_young_loop
from feelahead.lab.approaches.outcome import Outcome
from feelahead.lab.approaches.pictures import draw_comparison, draw_run, law_of_row, words_of_row
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from robot_side.drivers.mujoco.robot_model import SiteAxis
from robot_side.laws.paper_settings import PaperFlags
from robot_side.settings import Assist

_QUICK: Final = ("wall", "edge")
_FARTHEST_MM: Final = 1000.0
"""Distance up to which gaps are measured, in mm."""
_Force = Annotated[float, Meta(ge=0.0, le=20.0)]


@dataclass(frozen=True)
class ApproachSettings(PaperFlags, Sweep):
    """Press R2 with a finger of constant force until the gripper touches something or comes to rest.

    Both sides run in virtual time with the real messages, link, trigger effects and physics. Without --model, every
    frozen scene of tests/data that ends in a contact is tried; with --quick two of them. Options with several values
    are combined with each other. --summary has the figures of a single run, or of all runs.
    """

    model: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE.xml...")] = ()
    """MJCF files, each with an arm and objects ahead of its tool. Unless given: the frozen scenes."""
    site: Annotated[str, tyro.conf.arg(metavar="NAME")] = SITE
    """Name of the site between the fingertips."""
    site_axis: SiteAxis = "z"
    """Axis of the site along which R2 advances."""
    force: Annotated[tuple[_Force, ...], tyro.conf.arg(metavar="N...")] = (3.0,)
    """Force on R2 in newtons, 0 to 20: 2 is a light pull, 3.7 a normal one."""
    strongest_effect: Annotated[tuple[_Force, ...], tyro.conf.arg(metavar="N...")] = (2.0,)
    """Force in newtons with which the strongest effect resists. It was never measured; 1.5, 2 and 3 span the likely
    range."""
    link: Annotated[tuple[str, ...], tyro.conf.arg(metavar="SPEC...")] = ("",)
    """Emulated links, in both directions, in netem's syntax: "delay 200ms 10ms distribution normal"."""
    link_model: LinkModel = "datagram"
    """datagram: messages may be lost and reordered. stream: messages stay in order and losses delay them."""
    law: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME|FILE.py...")] = ("swept",)
    """Laws to compare. swept: objects ahead along the trigger. paper: the paper's law. paper-isotropic: as it
    is printed. none: no haptics. full: always the strongest effect. FILE.py: a law of your own (docs/python.md)."""
    compensation: tuple[Compensation, ...] = ("operator",)
    """Side that compensates the delay. operator: by the commands under way. robot: by speed times loop age (v t_d,
    eq. 8), as the paper's laws always do."""
    haptics: bool = True
    """Whether the law is felt; --no-haptics is the same as --law none."""
    probability: Annotated[float, Meta(gt=0.0, lt=1.0), tyro.conf.arg(metavar="P")] = 0.99
    """Probability P of the laws (eq. 10)."""
    duration: Annotated[float, Meta(ge=0.05, le=1000.0), tyro.conf.arg(metavar="SECONDS")] = 8.0
    """Duration from the beginning of the pull, in virtual time; a contact ends the run."""
    grip: bool = False
    """Before the pull, grip the object between the fingers."""
    stick: Annotated[tuple[float, float], tyro.conf.arg(metavar="RIGHT UP")] = (0.0, 0.0)
    """Deflection of the stick that moves across, during the first 1.5 s; its length is at most 1, which is 0.1 m/s."""
    turn: Annotated[tuple[float, float], tyro.conf.arg(metavar="RIGHT UP")] = (0.0, 0.0)
    """Deflection of the stick that turns, during the first 1.5 s; its length is at most 1, which is 0.5 rad/s."""
    assist: Assist = "none"
    """speed: the robot side also limits the speed along the triggers. none: it does not."""
    full_rate: bool = False
    """Let both sides send every message, even if its change cannot be felt."""
    tick_period: TickPeriod = TURN
    """Period of both sides' turns, 1ms to 20ms."""
    camera_mm: Annotated[float, Meta(ge=0.0, le=1000.0), tyro.conf.arg(metavar="MM")] = 3.0
    """Standard deviation of the camera's error; the law uses the same value."""

    def __post_init__(self) -> None:
        super().__post_init__()
        tick_period_s(self.tick_period)
        for name in ("force", "strongest_effect", "link", "compensation"):
            if not getattr(self, name):
                raise ValueError(f"--{name.replace('_', '-')}: no value is given; valid: one value or more")
        require_tried(self.law, "law", ("swept", "paper", "paper-isotropic", "none", "full"))
        for name in ("stick", "turn"):
            if not math.hypot(*getattr(self, name)) <= 1.0 + 1e-9:  # false for NaN, too
                raise ValueError(
                    f"--{name} {getattr(self, name)}: is longer than 1; valid: two numbers x and y with √(x² + y²) <= 1"
                )
        for spec in self.link:
            require_young_loop(spec, self.link_model)
        for model in self.model:
            require_input_file("--model", model, "an MJCF file")

    def models(self) -> tuple[Path, ...]:
        """Return the files of the scenes to try; ConfigurationError if the frozen scenes are missing."""
        return self.model or tuple(frozen_scene(name) for name in (_QUICK if self.quick else (*AHEAD, *ASIDE)))

    def laws(self) -> tuple[TriedLaw, ...]:
        """Return the laws to compare, each once."""
        if not self.haptics:
            return ("none",)
        return tuple(dict.fromkeys(with_compensation(law, side) for law in self.law for side in self.compensation))


def cells(settings: ApproachSettings) -> Iterator[Approach]:
    """Yield a cell for each combination of the values.

    In frozen scenes where a straight pull touches nothing, the sticks are deflected.
    """
    for model, link, force_n, strongest_n, law in product(
        settings.models(), settings.link, settings.force, settings.strongest_effect, settings.laws()
    ):
        frozen, asked = model.parent.resolve() == SCENES, (settings.stick, settings.turn)
        at_rest: tuple[Vector2, Vector2] = ((0.0, 0.0), (0.0, 0.0))
        stick, turn = ASIDE.get(model.stem, asked) if frozen and asked == at_rest else asked
        yield Approach(
            model=model,
            force_n=force_n,
            site=settings.site,
            site_axis=settings.site_axis,
            strongest_n=strongest_n,
            link=link,
            link_model=settings.link_model,
            law=law,
            paper=settings.paper,
            probability=settings.probability,
            duration_s=settings.duration,
            grip=settings.grip or (frozen and model.stem in GRIPPED),
            stick=stick,
            turn=turn,
            assist=settings.assist,
            full_rate=settings.full_rate,
            tick_period=settings.tick_period,
            camera_sd_m=1e-3 * settings.camera_mm,
        )


def run(cell: Approach, seed: int) -> Iterator[Row]:
    """Run one approach; yield its figures as a row."""
    yield figures(cell, run_approach(replace(cell, seed=seed)))


def figures(approach: Approach, outcome: Outcome) -> Row:
    """Return an outcome as a row; its trace, as lists, goes only to --summary."""
    gap_mm = outcome.least_gap_mm
    return {
        "law": without_compensation(approach.law),
        "compensation": compensation_of(approach.law),
        "haptics": approach.law != "none",
        **paper_figures(approach.paper if is_paper(approach.law) else None),
        "stick": approach.stick,
        "turn": approach.turn,
        **vars(outcome),
        "least_gap_mm": None if math.isnan(gap_mm) else gap_mm,
        "trace": {name: values.tolist() for name, values in vars(outcome.trace).items()},
    }


def show(_: ApproachSettings, table: Table) -> Iterator[RenderableType]:
    """Yield a sentence for a single run, or a table for several."""
    yield Text(sentence(table.rows[0])) if len(table) == 1 else comparison(table)


def sentence(row: Row) -> str:
    """Describe in a line or two how one run ended."""
    what = f"{row['force_n']:g} N in {Path(row['model']).stem}, law {words_of_row(row)}: "
    if row["why"] is not None:
        return f"{what}{row['end']}: {row['why']}"
    if row["contact_speed_mm_s"] is not None:
        speed = round(row["contact_speed_mm_s"])
        what += f"touches {row['contact_with']} at {speed} mm/s after {row['ended_s']:.2f} s"
    elif row["stops_at_mm"] is not None:
        what += (
            f"stops {_gap(row['stops_at_mm'])} from the nearest object ({_gap(row['way_left_mm'])} along the approach)"
        )
    else:
        what += f"undecided after {row['ended_s']:.1f} s: the gripper still moves"
    return f"{what}; least gap {_gap(row['least_gap_mm'])}, reversals {row['reversals']}"


def comparison(table: Table) -> Shown:
    """Return a table with a row for each scene, link and force, and a column for each law, over all seeds."""
    laws = {law_of_row(row): words_of_row(row) for row in table}
    names = scene_names(map(Path, table.values("model")))
    entries = [
        (
            *(names[Path(model)], link or "none", f"{force_n:g}", f"{strongest_n:g}"),
            *(_ends([row for row in rows if law_of_row(row) == law]) for law in laws),
        )
        for (model, link, force_n, strongest_n), rows in table.groups("model", "link", "force_n", "strongest_n")
    ]
    title = "contacts of runs, median mm/s [least to greatest]; mm off where it stopped; ? undecided; R most reversals"
    return shown(title, ("scene", "link", "N", "effect, N", *laws.values()), entries)


def draw(settings: ApproachSettings, table: Table, path: Path) -> None:
    """Draw zones, travel, speed and gap over time for a single run, or contact speed against delay for several."""
    (draw_run if len(table) == 1 else draw_comparison)(table, frozen_hash(settings.models()), path)


def _gap(gap_mm: float) -> str:
    return f"{gap_mm:.1f} mm" if gap_mm < _FARTHEST_MM else f"more than {_FARTHEST_MM:g} mm"


def _ends(rows: Sequence[Row]) -> str:
    """Describe in a few words how runs of one kind ended."""
    if not rows:
        return ""
    speeds, stops = Table(rows).values("contact_speed_mm_s"), Table(rows).values("stops_at_mm")
    parts = [f"{len(speeds)}/{len(rows)} at {_spread(speeds, 0)} mm/s"] if speeds else []
    parts += [f"{len(stops)}/{len(rows)} stop {_spread(stops, 1)} mm off"] if stops else []
    for end, said in (("undecided", "?"), ("disarmed", "disarmed"), ("failed", "failed")):
        if count := sum(row["end"] == end for row in rows):
            parts.append(f"{count}/{len(rows)} {said}")
    return ", ".join(parts) + f", R {max(row['reversals'] for row in rows)}"


def _spread(values: Sequence[float], digits: int) -> str:
    low, middle, high = (f"{value:.{digits}f}" for value in (min(values), median(values), max(values)))
    return middle if low == high else f"{middle} [{low} to {high}]"


QUESTION = Question(
    "try approach",
    ApproachSettings,
    cells,
    run,
    show,
    draw=draw,
    frozen=lambda settings: frozen_hash(settings.models()),
    failed=lambda row: row["end"] not in ("contact", "stopped"),
    prepare=compile_kernels,
)
