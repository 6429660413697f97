"""The demo's person over several seeds in virtual time: do they reach, grasp, lift and place, and feel it before?

feelahead try demo --seeds 10 --link "" "delay 200ms 10ms distribution normal"
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Annotated

import tyro
from rich.box import MARKDOWN
from rich.console import Console
from rich.table import Table
from rich.text import Text

from common.command.command_line import parse_settings
from common.emulation.clauses import LinkModel
from feelahead.approaches.processes import in_processes
from feelahead.approaches.progress import progress
from feelahead.experiments.approach.settings import require_young_loop
from feelahead.experiments.haptics.trial import Result, Trial, run_trial
from operator_side.simulated_person.settings import PersonSettings
from robot_side.simulation.built_in_scenes import SceneName

_PROGRAM = "feelahead try demo"


@dataclass(frozen=True)
class DemoRunsSettings:
    """The demo, seed by seed: the same two sides and the same person in virtual time, and what is true of the end."""

    scene: SceneName = "table"
    """As the demo's."""
    link: Annotated[tuple[str, ...], tyro.conf.arg(metavar="SPEC...")] = ("", "delay 200ms 10ms distribution normal")
    """Emulated links, both ways, in netem's words."""
    link_model: LinkModel = "datagram"
    """datagram lets jitter reorder messages, stream keeps them in order."""
    seeds: Annotated[int, tyro.conf.arg(metavar="N")] = 10
    """The seeds are 0 to N-1."""
    duration: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 40.0
    """The limit of each run, in virtual time."""
    workers: Annotated[int, tyro.conf.arg(metavar="N")] = 2
    """Runs at the same time."""
    person: PersonSettings = field(default_factory=PersonSettings)

    def __post_init__(self) -> None:
        for name, lowest in (("seeds", 1), ("workers", 1)):
            if getattr(self, name) < lowest:
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {lowest} or more")
        if self.person.pull_n is not None:
            raise ValueError(f"--person.pull-n {self.person.pull_n}: valid: not here, where a task is done")
        if not 0.0 < self.duration < 1e4:
            raise ValueError(f"--duration {self.duration}: valid: above 0 and below 10000 seconds")
        if not self.link:
            raise ValueError("--link: valid: one value or more")
        for spec in self.link:
            require_young_loop(spec, self.link_model)


def table(link: str, results: Sequence[Result]) -> Table:
    """A row for each seed, and how many did it."""
    shown = Table(title=Text(f"link: {link or 'none'}"), box=MARKDOWN)
    for heading in (
        *("seed", "grasped", "lifted, mm", "placed", "felt before touch, s", "mm", "touched at, mm/s", "tilt, °"),
        *("hits", "finished, s"),
    ):
        shown.add_column(heading, justify="right")
    for seed, one in enumerate(results):
        shown.add_row(
            str(seed),
            _yes(one.grasped),
            f"{one.lifted_mm:.0f}",
            _yes(one.placed),
            _number(one.felt_before_s, 2),
            _number(one.felt_before_mm, 0),
            _number(one.placing_speed_mm_s, 0),
            _number(one.tilt_deg, 1),
            str(one.hits),
            _number(one.finished_s, 1),
        )
    shown.add_section()
    felt = sum(one.felt_before_s is not None and one.felt_before_s > 0.0 for one in results)
    shown.add_row(
        f"of {len(results)}",
        str(sum(one.grasped for one in results)),
        str(sum(one.lifted_mm > 50.0 for one in results)),
        str(sum(one.placed for one in results)),
        str(felt),
        *("", "", "", str(sum(one.hits for one in results))),
        str(sum(one.finished_s is not None for one in results)),
    )
    return shown


def _yes(done: bool) -> str:
    return "yes" if done else "NO"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def try_demo(arguments: Sequence[str]) -> int:
    """Run every seed over every link, and print a table for each link."""
    settings = parse_settings(DemoRunsSettings, _PROGRAM, arguments)
    keys = list(product(settings.link, range(settings.seeds)))
    trials = [
        (Trial(settings.scene, link, "reacting", seed, settings.person, settings.duration, settings.link_model),)
        for link, seed in keys
    ]
    results: dict[tuple[str, int], Result] = {}
    with progress("runs", float(len(keys))) as advance:
        for place, result in in_processes(run_trial, trials, settings.workers):
            results[keys[place]] = result
            advance(1.0)
    console = Console(width=120 if not sys.stdout.isatty() else None)
    for link in settings.link:
        console.print(table(link, [results[link, seed] for seed in range(settings.seeds)]))
    return 0
