"""Both sides for minutes: does anything grow?

    feelahead try soak --minutes 10 --virtual
    feelahead try soak --minutes 10 --observers 8

Resident memory and open descriptors at the start, in the middle and at the end; messages, stops and errors. Virtual:
both cores in this process, as fast as they go. Real: feelahead-robot and feelahead-operator with a simulated person,
over loopback. The person grasps, lifts, and then rests; their messages keep flowing.

The first two observers are feelahead-operator processes like the owner's, whose persons wait; the others are driven by
this process (light_observers.py), as a process each would be too much for two cores. The robot side's ticks are
reported with and without them, and judged by nobody: other programs use the machine, too.

The summaries' statistics keep up to 100 000 samples each: 0.8 MB for each of them over the first minutes, and no more.
The threshold allows for it.
"""

import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.command.command_line import parse_settings
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from feelahead.experiments.soak.processes import HERE, SoakProcesses
from feelahead.experiments.soak.sampling import SETTLED, Sample, flat, sample
from feelahead.experiments.soak.settings import SoakSettings
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

PROGRAM = "feelahead try soak"
_SAMPLES = 20
_PIECES = 10
"""Of virtual time between two samples, so that the bar moves."""
_ALONE_S = 30.0
"""At most so long the ticks are looked at before the observers come, and at most a tenth of the run."""
_GAP = "no command for"
"""How the reason of a gap stop begins."""


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
    """Processes over loopback; samples by name, and the merged summary with what the robot side's ticks took."""
    piece_s = 60.0 * settings.minutes / _SAMPLES
    with tempfile.TemporaryDirectory(prefix="feelahead-soak-") as folder, SoakProcesses(settings, Path(folder)) as run:
        run.wait(min(_ALONE_S, SETTLED * 60.0 * settings.minutes))
        ticks = {"alone": run.take_ticks_us()}
        if settings.observers:
            run.bring_observers()
        samples = {name: [one] for name, one in run.look(0.0).items()}
        for step in range(1, _SAMPLES + 1):
            run.wait(piece_s)
            minutes = step * piece_s / 60.0
            shown(minutes)
            for name, one in run.look(minutes).items():
                samples[name].append(one)
        ticks[f"with {run.watching} observers"] = run.take_ticks_us()
        return samples, run.end() | {"ticks_by_watchers_us": ticks}


def table(samples: dict[str, list[Sample]]) -> Table:
    """Start, settled, middle and end of each process."""
    shown = Table(title="soak")
    for heading in ("process", "at, min", "resident, MB", "descriptors"):
        shown.add_column(heading, justify="left" if heading == "process" else "right")
    for name, series in samples.items():
        for index in (0, int(SETTLED * len(series)), len(series) // 2, len(series) - 1):
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
    is_flat = all(flat(series, settings.light if name == HERE else 1) for name, series in samples.items())
    for line in (*_told(summary), "flat" if is_flat else "NOT FLAT"):
        console.print(line, highlight=False, soft_wrap=True)
    return 0 if is_flat and not summary["errors"] else 1


def _told(summary: Mapping[str, Any]) -> list[str]:
    lines = [f"messages {summary['messages']}"]
    for when, (median_us, p99_us) in summary.get("ticks_by_watchers_us", {}).items():
        lines.append(f"tick of the robot side {when}: median {median_us:.0f} us, p99 {p99_us:.0f} us")
    reasons = Counter("gap" if stop["reason"].startswith(_GAP) else stop["reason"] for stop in summary["stops"])
    stops = ", ".join(f"{count} x {reason}" for reason, count in reasons.items()) or "none"
    return [*lines, f"stops: {stops}; errors: {summary['errors'] or 'none'}"]
