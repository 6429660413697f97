"""What does hostile input at a real robot side's port cost the tick, and does the robot side bear it?

feelahead try hostile --count 100000

Two real processes on loopback without keys, where strangers get furthest. Quiet and hostile stretches alternate, so
that other work of the machine falls on both; each figure is the median over the status messages of a stretch. In
hostile ones 20 viewers watch and never read, too.
"""

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
import tyro
from msgspec import Meta
from rich.console import RenderableType

from feelahead.both_sides.memory import descriptors, resident_mb
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.real_time import START_S, started
from feelahead.lab.goals import Goal
from feelahead.lab.hostile.inputs import Attacker
from feelahead.lab.hostile.raw_zmtp import port_of
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table

_FIGURES: Final = ("tick_us", "tick_p99_us", "late_us")
_MOST_RATIO: Final = 1.10
"""The tick's p99 may grow by a tenth."""
_MOST_GROWTH_MB: Final = 10.0


@dataclass(frozen=True)
class HostileSweep(Sweep):
    """A robot side that an operator drives while strangers send it hostile messages and connections."""

    count: Annotated[int, Meta(ge=1, le=10_000_000), tyro.conf.arg(metavar="N")] = 100_000
    """Number of hostile inputs; --quick: 5000 at most."""
    rate: Annotated[float, Meta(ge=0.0, le=1e6), tyro.conf.arg(metavar="PER_S")] = 5000.0
    """Inputs a second, at most; 0 for as fast as they can be made."""
    stretches: Annotated[int, Meta(ge=1, le=1000), tyro.conf.arg(metavar="N")] = 10
    """Number of quiet stretches, and of hostile ones; they alternate."""
    quiet: Annotated[float, Meta(ge=0.5, le=60.0), tyro.conf.arg(metavar="SECONDS")] = 2.0
    """Length of a quiet stretch."""
    realtime: bool = False
    """Both sides with --realtime, against the noise of a busy machine."""


@dataclass(frozen=True)
class Attack:
    """One run."""

    count: int
    rate: float
    stretches: int
    quiet_s: float
    realtime: bool


def cells(settings: HostileSweep) -> Iterator[Attack]:
    """Lay out the one run."""
    count = min(settings.count, 5000) if settings.quick else settings.count
    yield Attack(count, settings.rate, settings.stretches, settings.quiet, settings.realtime)


def run(cell: Attack, seed: int) -> Iterator[Row]:
    """Run both sides and the strangers; a row for each stretch, and one for the end."""
    realtime = ["--realtime"] if cell.realtime else []
    with started(realtime, realtime) as both:
        while both.operator.wait_for("status", START_S).get("state") != "armed":
            pass
        attacker = Attacker(port_of(both.control), port_of(both.view), seed)
        yield from _alternate(cell, both.robot, attacker)
        for side in (both.operator, both.robot):  # at once, lest one takes the other's end for a fault
            side.interrupt()
        codes = [both.operator.stop(), both.robot.stop()]
        summary, driven = both.summaries()
    yield {
        "phase": "end",
        "sent": attacker.sent.total(),
        "refused": attacker.refused,
        "motion_sent": driven["messages"]["motion_sent"],
        "motion_received": summary["messages"]["motion_received"],
        "stops": len(summary["stops"]),
        "overruns": summary["overruns"],
        "ticks": summary["ticks"],
        "exit_codes": sum(code != 0 for code in codes),
        "kinds": dict(attacker.sent),
        "strangers": summary["strangers"],
    }


def _alternate(cell: Attack, robot: SideProcess, attacker: Attacker) -> Iterator[Row]:
    for stretch in range(cell.stretches):
        robot.events()
        time.sleep(cell.quiet_s)
        yield _seen(robot, "quiet", stretch)
        attacker.watch()
        began_s, already = time.monotonic(), attacker.sent.total()
        while (sent := attacker.sent.total()) < cell.count * (stretch + 1) // cell.stretches:
            ahead_s = (sent - already) / cell.rate - (time.monotonic() - began_s) if cell.rate else 0.0
            if ahead_s > 0.001:
                time.sleep(ahead_s)
            attacker.send()
            if sent % 1000 == 0:
                robot.check()
        yield _seen(robot, "hostile", stretch)
        attacker.leave()
    attacker.close()
    time.sleep(cell.quiet_s)
    yield _seen(robot, "quiet", cell.stretches)


def _seen(robot: SideProcess, phase: str, stretch: int) -> Row:
    """Take the figures of this stretch, without its first status, which reaches into the one before."""
    robot.check()
    said = [event for event in robot.events() if event["event"] == "status"][1:]
    medians = {name: float(np.median([one[name] for one in said])) if said else None for name in _FIGURES}
    process = robot.process_id
    own = {"memory_mb": resident_mb(process), "descriptors": descriptors(process)}
    return {"phase": phase, "stretch": stretch, "armed": all(one["state"] == "armed" for one in said)} | medians | own


def _median(table: Table, phase: str, name: str) -> float:
    values = table.where(phase=phase).values(name)
    return float(np.median(values)) if values else float("nan")


def growth_mb(table: Table, phase: str) -> float:
    """Add up the growth of memory in all stretches of one kind; the statistics of a run fill up in both."""
    runs = (rows for _, rows in Table(row for row in table if "memory_mb" in row).groups("seed"))
    steps = (step for rows in runs for step in itertools.pairwise(rows))
    return float(sum(after["memory_mb"] - before["memory_mb"] for before, after in steps if after["phase"] == phase))


def show(_: HostileSweep, table: Table) -> Iterator[RenderableType]:
    """Show each figure quiet and under attack, and the counts of the end."""
    phases = ("quiet", "hostile")
    names = (*_FIGURES, "memory_mb", "descriptors")
    lines: list[tuple[str | float, ...]] = [
        (name, *(_median(table, phase, name) for phase in phases)) for name in names
    ]
    lines.append(("memory growth, MB", *(growth_mb(table, phase) for phase in phases)))
    for end in table.where(phase="end"):
        lines += [(name, "", str(end[name])) for name in list(end)[list(end).index("sent") :]]
    yield shown("hostile input at the robot side's port", ("figure", *phases), lines)


def goals(_: HostileSweep, table: Table) -> Iterator[Goal]:
    """Hold what strangers may cost against its limits."""
    ratio = _median(table, "hostile", "tick_p99_us") / _median(table, "quiet", "tick_p99_us")
    yield Goal("tick p99 under attack by quiet", ratio, _MOST_RATIO)
    yield Goal("memory grown under attack, MB", growth_mb(table, "hostile"), _MOST_GROWTH_MB)
    for name in ("stops", "exit_codes"):
        yield Goal(f"{name} that are not 0", float(sum(table.values(name))), 0)


def failed(row: dict[str, Any]) -> bool:
    """Recognise a side that did not end well."""
    return bool(row.get("exit_codes"))


QUESTION = Question("try hostile", HostileSweep, cells, run, show, goals=goals, failed=failed, timed=True)
