"""Both sides for minutes: does anything grow?

    feelahead try soak --minutes 10 --virtual
    feelahead try soak --minutes 2

Resident memory and open descriptors at the start, in the middle and at the end; messages and errors. Virtual: both
cores in this process, as fast as they go. Real: feelahead-robot and feelahead-operator with a simulated person, over
loopback. The person grasps, lifts, and then rests; their messages keep flowing.

The summaries' statistics keep up to 100 000 samples each: 0.8 MB for each of them over the first minutes, and no more.
The threshold allows for it.
"""

import json
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.clock import MonotonicClock
from common.command.command_line import parse_settings
from common.emulation.spec import LinkSpec
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.summary import merge_summaries
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

PROGRAM = "feelahead try soak"
_SETTLED = 0.1
"""The first tenth of the run fills what is bounded: it counts as the start from then on."""
_FLAT_KB = 10 * 1024
_START_S = 90.0
_SAMPLES = 20
_PIECES = 10
"""Of virtual time between two samples, so that the bar moves."""


@dataclass(frozen=True)
class SoakSettings:
    """Run both sides for a while, and tell whether memory and descriptors stay flat."""

    minutes: Annotated[float, tyro.conf.arg(metavar="N")] = 2.0
    """How long, in the time of the run."""
    virtual: bool = False
    """In virtual time, in one process."""
    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = "delay 20ms 5ms"
    """Emulated link, in netem's words."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """For every random draw."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        LinkSpec.parse(self.link, 0)
        if not 0.0 < self.minutes <= 1440.0:
            raise ValueError(f"--minutes {self.minutes}: valid: above 0 to 1440")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or a larger whole number")


@dataclass(frozen=True)
class Sample:
    """One process at one moment."""

    minutes: float
    resident_kb: int
    descriptors: int


def sample(process_id: int | str, minutes: float) -> Sample:
    """Look at a process ("self" is this one); ValueError when Linux does not tell."""
    folder = Path("/proc") / str(process_id)
    for line in (folder / "status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return Sample(minutes, int(line.split()[1]), sum(1 for _ in (folder / "fd").iterdir()))
    raise ValueError(f"process {process_id} tells no VmRSS; valid: a running process on Linux")


def flat(samples: Sequence[Sample]) -> bool:
    """Whether memory grew by less than 10 MB, and descriptors not at all, from the settled start to the end."""
    settled = samples[int(_SETTLED * len(samples))]
    last = samples[-1]
    return last.resident_kb - settled.resident_kb < _FLAT_KB and last.descriptors <= settled.descriptors


def run_virtual(settings: SoakSettings, shown: Callable[[float], None]) -> tuple[dict[str, list[Sample]], Any]:
    """Both cores in this process; samples by name, and the summary."""
    robot = RobotSettings(link=settings.link, seed=settings.seed)
    operator = OperatorSettings(link=settings.link, seed=settings.seed)
    both = Loopback(LoopbackSettings(robot, operator))
    samples = []
    for step in range(_SAMPLES * _PIECES + 1):
        minutes = settings.minutes * step / (_SAMPLES * _PIECES)
        both.run_until(60.0 * minutes)
        shown(minutes)
        if step % _PIECES == 0:
            samples.append(sample("self", minutes))
    return {"both sides": samples}, both.summary() | {"errors": []}


def run_real(settings: SoakSettings, shown: Callable[[float], None]) -> tuple[dict[str, list[Sample]], Any]:
    """Two processes over loopback; samples by name, and the merged summary."""
    clock, pause = MonotonicClock(), threading.Event()
    shared = [f"--link={settings.link}", f"--seed={settings.seed}"]
    with tempfile.TemporaryDirectory(prefix="feelahead-soak-") as folder:
        paths = [Path(folder) / f"{side}.json" for side in ("robot", "operator")]
        arguments = ["--bind=tcp://127.0.0.1:0", f"--summary={paths[0]}", *shared]
        with SideProcess("robot_side.main", "robot", arguments) as robot:
            heard = robot.wait_for("listening", _START_S)
            endpoints = [f"--connect={heard['control']}", f"--view-connect={heard['view']}"]
            arguments = [*endpoints, "--device=simulated", f"--summary={paths[1]}", *shared]
            with SideProcess("operator_side.main", "operator", arguments) as operator:
                while operator.wait_for("status", _START_S).get("link") != "up":
                    pass
                sides = {"robot side": robot, "operator side": operator}
                samples: dict[str, list[Sample]] = {name: [] for name in sides}
                start_s = clock.now()
                for step in range(_SAMPLES + 1):
                    due_s = start_s + 60.0 * settings.minutes * step / _SAMPLES
                    while (left_s := due_s - clock.now()) > 0.0:
                        pause.wait(min(left_s, 0.5))
                        shown((clock.now() - start_s) / 60.0)
                    for name, side in sides.items():
                        side.check()
                        side.events()
                        samples[name].append(sample(side.process_id, settings.minutes * step / _SAMPLES))
                # Both at once: neither is to take the other's end for a fault of the link.
                operator.interrupt()
                robot.interrupt()
                operator.stop()
                robot.stop()
        robot_summary, operator_summary = (json.loads(path.read_text(encoding="utf-8")) for path in paths)
    return samples, merge_summaries(robot_summary, operator_summary, [])


def table(samples: dict[str, list[Sample]]) -> Table:
    """Start, settled, middle and end of each process."""
    shown = Table(title="soak")
    for heading in ("process", "at, min", "resident, MB", "descriptors"):
        shown.add_column(heading, justify="left" if heading == "process" else "right")
    for name, series in samples.items():
        for index in (0, int(_SETTLED * len(series)), len(series) // 2, len(series) - 1):
            one = series[index]
            shown.add_row(name, f"{one.minutes:.1f}", f"{one.resident_kb / 1024:.1f}", str(one.descriptors))
        shown.add_section()
    return shown


def try_soak(arguments: Sequence[str]) -> int:
    """Soak, and print what was seen; exit code 1 when something grew or failed."""
    settings = parse_settings(SoakSettings, PROGRAM, arguments)
    run = run_virtual if settings.virtual else run_real
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("minutes", total=settings.minutes)
        samples, summary = run(settings, lambda minutes: progress.update(bar, completed=minutes))
    console = Console(width=None if sys.stdout.isatty() else 120)
    console.print(table(samples))
    is_flat = all(flat(series) for series in samples.values())
    console.print(f"messages {summary['messages']}", highlight=False)
    console.print(f"stops {summary['stops']}, errors {summary['errors']}", highlight=False)
    console.print("flat" if is_flat else "NOT FLAT", highlight=False)
    return 0 if is_flat and not summary["errors"] else 1
