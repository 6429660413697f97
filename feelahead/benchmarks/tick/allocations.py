"""Whether the robot side's memory stays flat, and what its ticks allocate: in one process and virtual time."""

import gc
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import FeelaheadError
from feelahead.benchmarks.report import Goal, Table
from feelahead.benchmarks.tick.array_memory import ArrayMemory, counted
from feelahead.benchmarks.tick.crowd import Crowd, CrowdedCamera
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from robot_side.core import RobotSide
from robot_side.main import TICK_PERIOD_S

_WARMING: Final = 2_000
"""Ticks until tables have grown to what the scene needs."""
_COUNTED: Final = 1_000
"""Ticks of which each request is counted, and each array that stays."""
_POINTS: Final = 10
_SHOWN: Final = 25
_ROOT: Final = Path(__file__).parents[3]


@dataclass(frozen=True)
class Line:
    """One line of Python that makes NumPy allocate."""

    place: str
    times_a_tick: float
    bytes_a_tick: float


@dataclass(frozen=True)
class Allocations:
    """What a run of some ticks needed."""

    ticks: int
    resident_mb: tuple[float, ...]
    """At evenly spaced moments of the run, the first one after warming up"""
    kept_bytes: float
    """What NumPy's arrays grew by, a tick"""
    lines: tuple[Line, ...]
    """Those of the robot side's tick, the most often first"""

    @property
    def growth_mb(self) -> float:
        """Of what is resident, from the first of these moments but one, which fills what is bounded, to the last."""
        return self.resident_mb[-1] - self.resident_mb[1]


class _Counting:
    """Makes a core whose ticks are counted while they are to be."""

    def __init__(self) -> None:
        self.memory: ArrayMemory | None = None

    def side(self, *arguments: object, **others: object) -> RobotSide:
        """As RobotSide."""
        core = RobotSide(*arguments, **others)  # type: ignore[arg-type]
        tick: Callable[[float], object] = core.tick

        def maybe_counted(now_s: float) -> object:
            if self.memory is None:
                return tick(now_s)
            with counted(self.memory):
                return tick(now_s)

        core.tick = maybe_counted  # type: ignore[method-assign,assignment]
        return core


def allocations(ticks: int, objects: int = 0, moving: int = 0) -> Allocations:
    """Run so many ticks after warming up; `objects` more are perceived, of which so many move."""
    counting = _Counting()
    both = Loopback(LoopbackSettings(), robot_side=counting.side)
    if objects:
        both.robot._camera = CrowdedCamera(both.robot._camera, Crowd(objects, moving))
    done = 0

    def go(more: int) -> None:
        nonlocal done
        done += more
        both.run_until((done - 0.5) * TICK_PERIOD_S)

    go(_WARMING)
    some = min(_COUNTED, ticks)
    counting.memory = memory = ArrayMemory()
    go(some)
    counting.memory = None
    tracemalloc.start()
    # What is always there is made anew once, so that it is known.
    go(some)
    before = _arrays_bytes()
    go(some)
    kept = (_arrays_bytes() - before) / some
    tracemalloc.stop()
    resident = [_resident_mb()]
    for _ in range(_POINTS):
        go(max(ticks // _POINTS, 1))
        resident.append(_resident_mb())
    lines = [
        Line(f"{_shown(file)}:{number}", times / some, memory.size_bytes[file, number] / some)
        for (file, number), times in memory.times.most_common()
    ]
    return Allocations(done, tuple(resident), kept, tuple(lines))


def tables(found: Allocations) -> list[Table]:
    """For people."""
    total = sum(line.times_a_tick for line in found.lines), sum(line.bytes_a_tick for line in found.lines)
    rows = [(line.place, f"{line.times_a_tick:.2f}", f"{line.bytes_a_tick:.0f}") for line in found.lines[:_SHOWN]]
    return [
        Table(
            "what is resident while ticks go by, both sides in one process",
            ("ticks", "MB"),
            [
                (f"{done:.0f}", f"{resident:.1f}")
                for done, resident in zip(
                    np.linspace(found.ticks - _ticks_of_run(found), found.ticks, len(found.resident_mb)),
                    found.resident_mb,
                    strict=True,
                )
            ],
        ),
        Table(
            "who makes NumPy allocate in a tick of the robot side",
            ("line", "times a tick", "bytes a tick"),
            [*rows, ("all", f"{total[0]:.1f}", f"{total[1]:.0f}")],
            f"What is still there of it afterwards: {found.kept_bytes:.2f} bytes a tick.",
        ),
    ]


def goals(found: Allocations) -> list[Goal]:
    """What is promised."""
    return [
        Goal("what is resident grows by, MB", found.growth_mb, 2.0),
        Goal("NumPy's arrays keep of a tick, bytes", found.kept_bytes, 1.0),
        Goal("NumPy allocates in a tick, times", sum(line.times_a_tick for line in found.lines), 0.0),
    ]


def _ticks_of_run(found: Allocations) -> int:
    return found.ticks - _WARMING - 3 * _COUNTED


def _shown(file: str) -> str:
    path = Path(file)
    return str(path.relative_to(_ROOT)) if path.is_relative_to(_ROOT) else "/".join(path.parts[-2:])


def _arrays_bytes() -> int:
    """What NumPy's arrays hold that were made since tracing began."""
    gc.collect()
    ours = tracemalloc.DomainFilter(inclusive=True, domain=np.lib.tracemalloc_domain)
    return sum(trace.size for trace in tracemalloc.take_snapshot().filter_traces([ours]).traces)


def _resident_mb() -> float:
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024.0
    raise FeelaheadError("this system does not tell what a process has resident; valid: Linux")
