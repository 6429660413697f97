"""How exact are the error propagation (eq. 5) and the predicted displacement (eq. 8), and what time do they take?

feelahead bench error --quick
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import tyro
from msgspec import Meta
from rich.console import RenderableType
from rich.table import Table as Shown

from common.files.output_file import output_file, require_output_file
from common.protocol.messages import Compensation
from feelahead.lab.approaches.frozen import SITE, frozen_hash, frozen_scene
from feelahead.lab.approaches.prediction import (
    AGE_BINS_S,
    COMPENSATIONS,
    Spread,
    error_table,
    judge,
    over,
)
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind
from feelahead.lab.approaches.recording import record_approach
from feelahead.lab.figures import figure
from feelahead.lab.goals import short
from feelahead.lab.propagation import BATCHES, METHODS, NOISE_RAD, SINGULAR, PosedGripper, measure, run_times_us
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.joint_reference import MotionLimits
from robot_side.drivers.mujoco.scene import load_scene

DELAYS_MS: Final = (0, 25, 50, 100, 200, 400)
"""Delays in each direction, in milliseconds."""
QUICK_DELAYS_MS: Final = (0, 50, 200, 400)
QUICK_PULLS: Final[tuple[PullKind, ...]] = ("bell", "on_off", "random")
QUICK_TURNS: Final = 4
_SCENE: Final = "empty"
_KINDS: Final[dict[Compensation, tuple[str, str]]] = {
    "operator": ("own commands under way", "#0072b2"),
    "robot": ("v t_d (eq. 8)", "#d55e00"),
}
_COLOURS: Final = {"linear": "#0072b2", "unscented": "#d55e00"}
_LEAST_MM: Final = 0.01
"""Lower end of the figure's logarithmic axis, in mm."""
_Draws = Annotated[int, Meta(ge=100 * BATCHES, le=10_000_000)]


@dataclass(frozen=True)
class ErrorSettings(Sweep):
    """Measure run time and error of the error propagation (eq. 5), and the error of the predicted displacement.

    Error propagation: the joints of the built-in arm have errors of 1e-5 to 1e-1 rad. The gripper's error is estimated
    by eq. 5 in each configuration, by the paper's single estimate for all configurations, and by the unscented
    transform. A Monte Carlo simulation counts as the truth. Displacement: simulated hands pull R2 over links of 0 to
    400 ms in each direction. The gripper's displacement, from the robot's newest report until a command sent now takes
    effect, is predicted by the commands under way, and as v t_d (eq. 8). --table writes mean and standard deviation of
    the prediction errors, for eq. 10. A seed always gives the same figures, except run times. It takes five minutes on
    a free core; with --quick a minute, with fewer draws, configurations, pulls and links, and one seed.
    """

    seeds: Annotated[int, Meta(ge=1, le=10_000), tyro.conf.arg(metavar="N")] = 3
    """Number of seeds for each pull over each link."""
    draws: Annotated[_Draws | None, tyro.conf.arg(metavar="N")] = None
    """Number of draws of the Monte Carlo in each configuration, a multiple of 20; 400000 unless given, 100000 with
    --quick."""
    table: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Write mean and standard deviation of the prediction errors to this file, by loop age and kind of compensation."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.draws is not None and self.draws % BATCHES:
            raise ValueError(
                f"--draws {self.draws}: cannot be split into {BATCHES} equal parts; valid: a multiple of {BATCHES}"
            )
        require_output_file("--table", self.table)


@dataclass(frozen=True)
class Propagation:
    """Cell of the error propagation: one configuration of the arm, by its number among `configurations` + 2."""

    number: int
    configurations: int
    draws: int
    before_seed: int


@dataclass(frozen=True)
class RunTimes:
    """Cell that measures the run time of one call of each method."""

    turns: int
    before_seed: int


@dataclass(frozen=True)
class Prediction:
    """Cell of the predicted displacement: one pull over one link."""

    pull: PullKind
    link: str
    duration_s: float
    before_seed: int


Cell = Propagation | RunTimes | Prediction


def link_spec(delay_ms: int) -> str:
    """Return a link with this delay each way and normal jitter: 10 ms, or a quarter of the delay if that is less."""
    jitter_ms = min(10, delay_ms // 4)
    return f"delay {delay_ms}ms {jitter_ms}ms distribution normal" if jitter_ms > 0 else ""


def cells(settings: ErrorSettings) -> Iterator[Cell]:
    """Yield the cells: configurations, run times, and each pull over each link; only pulls have several seeds."""
    quick, second = settings.quick, settings.seed + 1
    configurations = 4 if quick else 12
    draws = settings.draws or (100_000 if quick else 400_000)
    yield from (Propagation(number, configurations, draws, second) for number in range(configurations + 2))
    yield RunTimes(QUICK_TURNS if quick else 20, second)
    for delay_ms in QUICK_DELAYS_MS if quick else DELAYS_MS:
        for pull in QUICK_PULLS if quick else PULL_KINDS:
            last = second if quick else settings.seed + settings.seeds
            yield Prediction(pull, link_spec(delay_ms), 2.0 if quick else 4.0, last)


def run(cell: Cell, seed: int) -> Iterator[Row]:
    """Yield rows of kind `propagation`, `run time` or `prediction`."""
    if seed >= cell.before_seed:
        return
    if isinstance(cell, Propagation):
        gripper = PosedGripper(load_scene())
        rows = measure(gripper, cell.number, cell.configurations, cell.draws, seed)
        yield from ({"kind": "propagation"} | row for row in rows)
    elif isinstance(cell, RunTimes):
        times_us = run_times_us(PosedGripper(load_scene()), cell.turns)
        yield from ({"kind": "run time", "method": name, "run_time_us": value} for name, value in times_us.items())
    else:
        record = record_approach(cell.pull, cell.link, seed, cell.duration_s, _SCENE)
        judged = judge(record, _gripper().at, MotionLimits(), ToolMotionSettings().trigger_speed_m_s)
        found = Table([judged])
        figures = {
            f"{kind}_{name}": value
            for kind in COMPENSATIONS
            for name, value in over(found, kind)._asdict().items()
            if name != "moments"
        }
        yield {"kind": "prediction", "moments": len(judged["displacement_m"])} | figures | judged


@cache
def _gripper() -> PosedGripper:
    return PosedGripper(load_scene(frozen_scene(_SCENE), SITE))


def write_table(settings: ErrorSettings, table: Table) -> None:
    """Write the table of prediction errors to the file of --table, if it is given."""
    if settings.table is not None:
        arm, speed_m_s = load_scene().robot.fingerprint, ToolMotionSettings().trigger_speed_m_s
        with output_file("--table", settings.table) as file:
            file.write(error_table(table.where(kind="prediction"), arm, frozen_hash(), speed_m_s))


def show(_: ErrorSettings, table: Table) -> Iterator[RenderableType]:
    """Yield tables of the propagation by joint noise, and of the prediction by loop age and pull."""
    judged = table.where(kind="prediction")
    yield _by_noise(table.where(kind="propagation"))
    times = ((row["method"], row["run_time_us"]) for row in table.where(kind="run time"))
    yield shown("Run time of one point and direction", ("method", "µs a call"), times)
    columns = ("pull", "loop age, ms", "moments", *(name for name, _ in _KINDS.values()))
    title = "Displacement until a command takes effect, truth less prediction, mm: mean, sd, 99 %, greatest"
    yield shown(title, columns, _spreads(judged, COMPENSATIONS, within_reach=True))
    edge = _spreads(judged, COMPENSATIONS, within_reach=False)
    yield shown("At the edge of the arm's reach, not in the table above", columns, edge)


def _by_noise(propagated: Table) -> Shown:
    """Show median and worst error over all configurations but the singular one, then the worst error in that one."""
    rows = []
    for noise_rad in NOISE_RAD:
        here = propagated.where(noise_rad=noise_rad)
        entries = [f"{noise_rad:g}"]
        for name in (f"{method}_sd_error_percent" for method in METHODS):
            usual = [row[name] for row in here if row["place"] != SINGULAR]
            entries += [short(float(np.median(usual))), short(max(usual, key=abs))]
            entries.append(short(max(here.where(place=SINGULAR).values(name), key=abs)))
        rows.append(entries)
    columns = (heading for method in METHODS for heading in (method, "worst", SINGULAR))
    return shown("Standard deviation along the approach: error in %", ("joint noise, rad", *columns), rows)


def _spreads(judged: Table, names: Sequence[str], *, within_reach: bool) -> Iterator[Sequence[str]]:
    """Yield a row for each loop age and pull, and for all pulls together."""
    for ages_s in AGE_BINS_S:
        for pull in ("all", *PULL_KINDS):
            mine = judged if pull == "all" else judged.where(pull=pull)
            found = [over(mine, name, ages_s, within_reach=within_reach) for name in names]
            if found[0].moments:
                yield pull, f"{found[0].loop_age_ms:.0f}", str(found[0].moments), *map(cell_of, found)


def cell_of(found: Spread) -> str:
    """Return mean, standard deviation, 99 % quantile and maximum of errors as text, in mm."""
    return "-" if not found.moments else f"{found.mean_mm:+.2f} {found.sd_mm:.2f} {found.p99_mm:.2f} {found.max_mm:.2f}"


def draw(_: ErrorSettings, table: Table, path: Path) -> None:
    """Draw run time against error of the propagation, and the prediction errors against the loop age."""
    with figure(path, 1, 2, f"frozen {frozen_hash()}", figsize=(11.0, 4.4)) as (_, (left, right)):
        times_us = {row["method"]: row["run_time_us"] for row in table.where(kind="run time")}
        _draw_propagation(left, table.where(kind="propagation"), times_us)
        for kind, (label, colour) in _KINDS.items():
            every = (over(table.where(kind="prediction"), kind, ages_s) for ages_s in AGE_BINS_S)
            found = [one for one in every if one.moments]
            for of, style, said in (("p99_mm", "o-", f"{label}: 99 %"), ("sd_mm", ".--", "standard deviation")):
                errors_mm = [max(getattr(one, of), _LEAST_MM) for one in found]
                right.plot([one.loop_age_ms for one in found], errors_mm, style, color=colour, label=said)
        right.set(yscale="log", xlabel="loop age, ms", ylabel="error, mm")
        right.set_title("Displacement until a command takes effect, what predictions miss", fontsize=9)
        right.grid(alpha=0.3)
        right.legend(fontsize=7)


def _draw_propagation(axes: Any, propagated: Table, times_us: dict[str, float]) -> None:
    certainty = float(np.median(propagated.values("sd_uncertainty_percent")))
    for method, timed in (("linear", "linear, with kinematics"), ("unscented", "unscented")):
        for singular, mark in ((False, "o"), (True, "x")):
            label = f"{method}{', in the singular one' if singular else ''}"
            for noise_rad in NOISE_RAD:
                rows = [row for row in propagated.where(noise_rad=noise_rad) if (row["place"] == SINGULAR) is singular]
                error = float(np.median([abs(row[f"{method}_sd_error_percent"]) for row in rows]))
                place = times_us[timed], max(error, certainty)
                axes.plot(*place, mark, color=_COLOURS[method], label=label)
                label = ""
                if error > certainty:
                    axes.annotate(f"{noise_rad:g} rad", place, (5, -3), textcoords="offset points", fontsize=6)
    axes.axhline(certainty, color="black", linestyle=":", label="the truth's standard error")
    axes.set(xscale="log", yscale="log", xlabel="time of a call, µs", ylabel="error of the standard deviation, %")
    axes.set_title("Error propagation, median configuration (less noise: within the truth's error)", fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="upper right")


QUESTION = Question(
    "bench error",
    ErrorSettings,
    cells,
    run,
    show,
    draw=draw,
    also=write_table,
    frozen=lambda _: frozen_hash(),
    timed=True,
)
