"""Does the demo's person grasp, lift and place the target, and feel the surface before the target touches it?

feelahead try demo --seeds 10 --link "" "delay 200ms 10ms distribution normal"
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Final

import tyro
from msgspec import Meta
from rich.table import Table as Shown

from common.command.run_options import TickPeriod, tick_period_s
from common.emulation.clauses import LinkModel
from common.periods import TURN
from feelahead.both_sides.grasping_trial import Trial, run_trial
from feelahead.lab.approaches.links import require_young_loop
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from operator_side.people.settings import PersonSettings
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.drivers.mujoco.checks.joints import joint_findings
from robot_side.drivers.mujoco.checks.reach import reach_findings, target_findings
from robot_side.drivers.mujoco.checks.site_axis import site_findings
from robot_side.drivers.mujoco.checks.start_collision import start_collision
from robot_side.drivers.mujoco.gripper_measurement import measure_gripper
from robot_side.drivers.mujoco.robot_model import SiteAxis
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.laws.named import require_law
from robot_side.laws.paper_settings import PaperFlags

COLUMNS: Final = {
    "seed": ("seed", 0),
    "grasped": ("grasped", 0),
    "lifted_mm": ("lifted, mm", 0),
    "placed": ("placed", 0),
    "felt_before_s": ("felt before touch, s", 2),
    "felt_before_mm": ("mm", 0),
    "placing_speed_mm_s": ("touched at, mm/s", 0),
    "tilt_deg": ("tilt, °", 1),
    "hits": ("hits", 0),
    "finished_s": ("finished, s", 1),
}
"""Figures that are shown, with their headings and number of digits."""


@dataclass(frozen=True)
class DemoSettings(PaperFlags, Sweep):
    """Run the demo with each seed in virtual time, and judge each run by the simulation's true positions."""

    seeds: Annotated[int, Meta(ge=1), tyro.conf.arg(metavar="N")] = 10
    """Number of seeds."""
    scene: SceneName = "table"
    """Scene of the demo: table, wall, slot or shelf."""
    model: Annotated[Path | None, tyro.conf.arg(metavar="FILE.xml")] = None
    """MJCF arm with actuators, instead of the built-in one."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Site of the model between the fingertips, with the z axis along the approach."""
    site_axis: SiteAxis = "z"
    """Axis of the site along which R2 advances."""
    law: Annotated[str, tyro.conf.arg(metavar="NAME|FILE.py")] = "swept"
    """Law of the stiffness: swept, paper, paper-isotropic, or a file of your own (docs/python.md)."""
    link: Annotated[tuple[str, ...], tyro.conf.arg(metavar="SPEC...")] = ("", "delay 200ms 10ms distribution normal")
    """Emulated links, in both directions, in netem's syntax."""
    link_model: LinkModel = "datagram"
    """datagram: messages may be lost and reordered. stream: messages stay in order and losses delay them."""
    duration: Annotated[float, Meta(gt=0.0, lt=1e4), tyro.conf.arg(metavar="SECONDS")] = 40.0
    """Maximum duration of each run, in virtual time."""
    tick_period: TickPeriod = TURN
    """Period of both sides' turns, 1ms to 20ms."""
    person: Annotated[PersonSettings, tyro.conf.Suppress] = field(default_factory=PersonSettings)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_law(self.law)
        tick_period_s(self.tick_period)
        if not self.link:
            raise ValueError("--link: no value is given; valid: one value or more")
        for spec in self.link:
            require_young_loop(spec, self.link_model)


def cells(settings: DemoSettings) -> Iterator[Trial]:
    """Yield one cell for each link."""
    for link in settings.link[: 1 if settings.quick else None]:
        one = Trial(settings.scene, link, "reacting", settings.person, settings.duration, settings.link_model)
        own = replace(one, model=settings.model, site=settings.site, site_axis=settings.site_axis)
        yield replace(own, tick_period=settings.tick_period, law=settings.law, paper=settings.paper)


def run(cell: Trial, seed: int) -> Iterator[Row]:
    """Run the person's whole task once; yield its figures."""
    yield run_trial(cell, seed)


def show(settings: DemoSettings, table: Table) -> Iterator[Shown | str]:
    """Yield a table for each link, a row for each seed, and the number of successes; below it why runs failed.

    Last comes what the start says of the model.
    """
    for (link,), runs in table.groups("link"):
        lines = [[_said(one[name], digits) for name, (_, digits) in COLUMNS.items()] for one in runs]
        total = {name: str(sum(runs.values(name))) for name in ("grasped", "placed", "hits")} | {
            "seed": f"of {len(runs)}",
            "lifted_mm": str(sum(lifted > 50.0 for lifted in runs.values("lifted_mm"))),
            "felt_before_s": str(sum(early > 0.0 for early in runs.values("felt_before_s"))),
            "finished_s": str(len(runs.values("finished_s"))),
        }
        lines.append([total.get(name, "") for name in COLUMNS])
        yield shown(f"link: {link or 'none'}", (heading for heading, _ in COLUMNS.values()), lines)
        yield from (f"seed {one['seed']}: not placed: {one['why_not_placed']}" for one in runs if not one["placed"])
    if settings.model is not None and not all(table.values("placed")):
        yield from (f"at the start: {line}" for line in _findings(settings))


def _findings(settings: DemoSettings) -> list[str]:
    """Return what a robot side says at its start of a model that may not suit the task."""
    axis = settings.site_axis
    scene = load_scene(settings.model, settings.site, name=settings.scene, seed=settings.seed, site_axis=axis)
    travel = measure_gripper(scene)
    found = target_findings(scene) + site_findings(scene, axis, travel) + start_collision(scene)
    return found + joint_findings(scene, travel) + reach_findings(scene)


def _said(value: float | None, digits: int) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    return "-" if value is None else f"{value:.{digits}f}"


QUESTION = Question("try demo", DemoSettings, cells, run, show)
