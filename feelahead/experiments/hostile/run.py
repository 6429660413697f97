"""A robot side that is driven by an operator while strangers send it a hundred thousand hostile inputs.

    feelahead try hostile --count 100000

Two real processes on loopback without keys, where strangers get furthest. Quiet and hostile stretches alternate, so
that what else happens on the machine falls on both; each figure is the median over the status messages (five a
second) of its stretches. With keys, none of these inputs would get past the handshake.
"""

import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.command.command_line import parse_settings
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.summary import read_summary
from feelahead.experiments.hostile.hostile_inputs import Attacker
from feelahead.experiments.hostile.raw_zmtp import port_of

_PROGRAM = "feelahead try hostile"
_START_TIMEOUT_S = 90.0
_FIGURES = ("tick_us", "tick_p99_us", "late_us")
_GOAL = 1.10
"""The tick's p99 may grow by a tenth."""


@dataclass(frozen=True)
class HostileSettings:
    """How much is sent, how fast, and in how many stretches."""

    count: Annotated[int, tyro.conf.arg(metavar="N")] = 100_000
    """Hostile inputs: messages and connections."""
    rate: Annotated[float, tyro.conf.arg(metavar="PER_S")] = 5000.0
    """Inputs a second, at most; 0 for as fast as they can be made."""
    stretches: Annotated[int, tyro.conf.arg(metavar="N")] = 10
    """Quiet and hostile ones alternate, so many of each."""
    quiet: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 2.0
    """Length of a quiet stretch."""
    seed: int = 0
    realtime: bool = False
    """Both sides with --realtime, against the noise of a busy machine."""

    def __post_init__(self) -> None:
        for name, lowest, highest in (("count", 1, 10**7), ("stretches", 1, 1000), ("rate", 0.0, 1e6)):
            if not lowest <= getattr(self, name) <= highest:
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {lowest} to {highest}")
        if not 0.5 <= self.quiet <= 60.0:
            raise ValueError(f"--quiet {self.quiet}: valid: 0.5 to 60 seconds")


@dataclass
class Outcome:
    """What was seen of the robot side."""

    seen: dict[str, dict[str, list[float]]] = field(
        default_factory=lambda: {phase: {name: [] for name in _FIGURES} for phase in ("quiet", "hostile")}
    )
    memory_mb: list[float] = field(default_factory=list)
    """Resident, at the end of each stretch."""
    growth_mb: dict[str, float] = field(default_factory=lambda: {"quiet": 0.0, "hostile": 0.0})
    """In all stretches of each kind together; the statistics of a run fill up in both."""
    descriptors: list[int] = field(default_factory=list)
    """Open ones, likewise."""
    sent: Counter[str] = field(default_factory=Counter)
    hostile_s: float = 0.0
    states: list[str] = field(default_factory=list)
    robot: dict[str, Any] = field(default_factory=dict)
    operator: dict[str, Any] = field(default_factory=dict)
    exit_codes: tuple[int, int] = (0, 0)


def measure(settings: HostileSettings) -> Outcome:
    """Run both sides and the strangers; SideFailedError when a side crashes."""
    outcome = Outcome()
    with tempfile.TemporaryDirectory(prefix="feelahead-") as folder:
        paths = [Path(folder) / f"{side}.json" for side in ("robot", "operator")]
        shared = ["--realtime"] if settings.realtime else []
        robot_arguments = ["--bind=tcp://127.0.0.1:0", f"--summary={paths[0]}", *shared]
        with SideProcess("robot_side", "robot", robot_arguments) as robot:
            listening = robot.wait_for("listening", _START_TIMEOUT_S)
            ends = [f"--connect={listening['control']}", f"--view-connect={listening['view']}"]
            operator_arguments = [*ends, "--device=simulated", f"--summary={paths[1]}", *shared]
            with SideProcess("operator_side", "operator", operator_arguments) as operator:
                while operator.wait_for("status", _START_TIMEOUT_S).get("state") != "armed":
                    pass
                _alternate(settings, robot, listening, outcome)
                operator.interrupt()
                robot.interrupt()
                outcome.exit_codes = (operator.stop(), robot.stop())
        outcome.robot, outcome.operator = (read_summary(path) for path in paths)
    return outcome


def _alternate(settings: HostileSettings, robot: SideProcess, listening: dict[str, Any], outcome: Outcome) -> None:
    attacker = Attacker(port_of(listening["control"]), port_of(listening["view"]), settings.seed)
    with Progress(transient=True) as progress:
        bar = progress.add_task("hostile inputs", total=settings.count)
        for stretch in range(settings.stretches):
            robot.events()
            time.sleep(settings.quiet)
            _take_note(robot, outcome, "quiet")
            began_s = time.monotonic()
            target = settings.count * (stretch + 1) // settings.stretches
            already = attacker.sent.total()
            while (sent := attacker.sent.total()) < target:
                ahead_s = (sent - already) / settings.rate - (time.monotonic() - began_s) if settings.rate else 0.0
                if ahead_s > 0.001:
                    time.sleep(ahead_s)
                attacker.send()
                if sent % 1000 == 0:
                    progress.update(bar, completed=sent)
                    robot.check()
            outcome.hostile_s += time.monotonic() - began_s
            _take_note(robot, outcome, "hostile")
    attacker.close()
    time.sleep(settings.quiet)
    _take_note(robot, outcome, "quiet")
    outcome.sent = attacker.sent


def _take_note(robot: SideProcess, outcome: Outcome, phase: str) -> None:
    """What the robot side said in this stretch, its first status excepted, which reaches into the one before."""
    robot.check()
    said = [event for event in robot.events() if event["event"] == "status"][1:]
    for name in _FIGURES:
        outcome.seen[phase][name] += [event[name] for event in said]
    outcome.states += [event["state"] for event in said]
    process = Path("/proc") / str(robot.process_id)
    resident = next(line for line in (process / "status").read_text().splitlines() if line.startswith("VmRSS"))
    resident_mb = int(resident.split()[1]) / 1024
    if outcome.memory_mb:
        outcome.growth_mb[phase] += resident_mb - outcome.memory_mb[-1]
    outcome.memory_mb.append(resident_mb)
    outcome.descriptors.append(len(list((process / "fd").iterdir())))


def report(outcome: Outcome) -> Table:
    """Every figure with what it is to be."""
    shown = Table(title=f"{outcome.sent.total()} hostile inputs in {outcome.hostile_s:.1f} s: {dict(outcome.sent)}")
    for heading in ("figure", "quiet", "hostile", "ratio", "goal"):
        shown.add_column(heading, justify="left" if heading == "figure" else "right")
    for name, title in zip(_FIGURES, ("tick p50, us", "tick p99, us", "latest wake in 0.2 s, us"), strict=True):
        quiet, hostile = (median(outcome.seen[phase][name] or [0.0]) for phase in ("quiet", "hostile"))
        goal = f"< {_GOAL:.2f}" if name == "tick_p99_us" else ""
        shown.add_row(title, f"{quiet:.0f}", f"{hostile:.0f}", f"{hostile / quiet:.2f}" if quiet else "-", goal)
    shown.add_section()
    for title, values in (("memory, MB", outcome.memory_mb), ("descriptors", outcome.descriptors)):
        shown.add_row(f"{title}: first, largest, last", *(f"{one:.0f}" for one in (values[0], max(values), values[-1])))
    quiet_mb, hostile_mb = (f"{outcome.growth_mb[phase]:+.1f}" for phase in ("quiet", "hostile"))
    shown.add_row("memory growth, MB", quiet_mb, hostile_mb, "", "flat")
    robot, operator = outcome.robot["messages"], outcome.operator["messages"]
    shown.add_row("commands sent, received", str(operator["motion_sent"]), str(robot["motion_received"]), "", "all")
    shown.add_row("stops of the arm", "", str(len(outcome.robot["stops"])), "", "0")
    shown.add_row("overruns of ticks", "", f"{outcome.robot['overruns']} of {outcome.robot['ticks']}", "", "")
    shown.add_row("exit codes", *(str(code) for code in outcome.exit_codes), "", "0 0")
    shown.add_row("dropped", "", str(outcome.robot["strangers"]), "", "")
    return shown


def try_hostile_input(arguments: Sequence[str]) -> int:
    """Measure and print the table."""
    settings = parse_settings(HostileSettings, _PROGRAM, arguments)
    outcome = measure(settings)
    Console(width=140 if not sys.stdout.isatty() else None).print(report(outcome))
    return 0
