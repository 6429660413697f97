"""How exact is the predicted displacement (eq. 8)?

feelahead bench error --quick
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Final

import tyro
from msgspec import Meta
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
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from feelahead.printing.pictures import figure
from robot_side.arm.limits import ArmLimits
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.scene import load_scene

DELAYS_MS: Final = (0, 25, 50, 100, 200, 400)
"""Delays in each direction, in milliseconds."""
QUICK_DELAYS_MS: Final = (0, 50, 200, 400)
QUICK_PULLS: Final[tuple[PullKind, ...]] = ("bell", "on_off", "random")
_SCENE: Final = "empty"
_KINDS: Final[dict[Compensation, tuple[str, str]]] = {
    "operator": ("own commands under way", "#0072b2"),
    "robot": ("v t_d (eq. 8)", "#d55e00"),
}
_LEAST_MM: Final = 0.01
"""Lower end of the figure's logarithmic axis, in mm."""


@dataclass(frozen=True)
class ErrorSettings(Sweep):
    """Measure the error of the predicted displacement.

    Simulated hands pull R2 over links of 0 to 400 ms in each direction. The gripper's displacement, from the robot's
    newest report until a command sent now takes effect, is predicted by the commands under way, and as v t_d (eq. 8).
    --table writes mean and standard deviation of the prediction errors, for eq. 10. A seed always gives the same
    figures.
    """

    seeds: Annotated[int, Meta(ge=1, le=10_000), tyro.conf.arg(metavar="N")] = 3
    """Number of seeds for each pull over each link."""
    table: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Write mean and standard deviation of the prediction errors to this file, by loop age and kind of compensation."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_output_file("--table", self.table)


@dataclass(frozen=True)
class Prediction:
    """Cell: one pull over one link."""

    pull: PullKind
    link: str
    duration_s: float


def link_spec(delay_ms: int) -> str:
    """Return a link with this delay each way and normal jitter: 10 ms, or a quarter of the delay if that is less."""
    jitter_ms = min(10, delay_ms // 4)
    return f"delay {delay_ms}ms {jitter_ms}ms distribution normal" if jitter_ms > 0 else ""


def cells(settings: ErrorSettings) -> Iterator[Prediction]:
    """Yield the cells: each pull over each link."""
    for delay_ms in QUICK_DELAYS_MS if settings.quick else DELAYS_MS:
        for pull in QUICK_PULLS if settings.quick else PULL_KINDS:
            yield Prediction(pull, link_spec(delay_ms), 2.0 if settings.quick else 4.0)


def run(cell: Prediction, seed: int) -> Iterator[Row]:
    """Yield one row: figures of the prediction errors, and their values at each moment."""
    record = record_approach(cell.pull, cell.link, seed, cell.duration_s, _SCENE)
    judged = judge(record, _gripper().at, ArmLimits(), ToolMotionSettings().trigger_speed_m_s)
    found = Table([judged])
    figures = {
        f"{kind}_{name}": value
        for kind in COMPENSATIONS
        for name, value in over(found, kind)._asdict().items()
        if name != "moments"
    }
    yield {"moments": len(judged["displacement_m"])} | figures | judged


@cache
def _gripper() -> PosedGripper:
    return PosedGripper(load_scene(frozen_scene(_SCENE), SITE))


def write_table(settings: ErrorSettings, table: Table) -> None:
    """Write the table of prediction errors to the file of --table, if it is given."""
    if settings.table is not None:
        arm, speed_m_s = load_scene().robot.fingerprint, ToolMotionSettings().trigger_speed_m_s
        with output_file("--table", settings.table) as file:
            file.write(error_table(table, arm, frozen_hash(), speed_m_s))


def show(_: ErrorSettings, table: Table) -> Iterator[Shown]:
    """Yield tables of the prediction by loop age and pull."""
    columns = ("pull", "loop age, ms", "moments", *(name for name, _ in _KINDS.values()))
    title = "Displacement until a command takes effect, truth less prediction, mm: mean, sd, 99 %, greatest"
    yield shown(title, columns, _spreads(table, COMPENSATIONS, within_reach=True))
    edge = _spreads(table, COMPENSATIONS, within_reach=False)
    yield shown("At the edge of the arm's reach, not in the table above", columns, edge)


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
    """Draw the prediction errors against the loop age."""
    with figure(path, 1, 1, f"frozen {frozen_hash()}", figsize=(5.5, 4.4)) as (_, axes):
        for kind, (label, colour) in _KINDS.items():
            every = (over(table, kind, ages_s) for ages_s in AGE_BINS_S)
            found = [one for one in every if one.moments]
            for of, style, said in (("p99_mm", "o-", f"{label}: 99 %"), ("sd_mm", ".--", "standard deviation")):
                errors_mm = [max(getattr(one, of), _LEAST_MM) for one in found]
                axes.plot([one.loop_age_ms for one in found], errors_mm, style, color=colour, label=said)
        axes.set(yscale="log", xlabel="loop age, ms", ylabel="error, mm")
        axes.set_title("Displacement until a command takes effect, what predictions miss", fontsize=9)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)


QUESTION = Question(
    "bench error",
    ErrorSettings,
    cells,
    run,
    show,
    draw=draw,
    also=write_table,
    frozen=lambda _: frozen_hash(),
)
