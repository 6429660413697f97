"""Do memory, descriptors and delays stay flat over long runs, with and without observers?

feelahead try soak --minutes 10 --virtual
feelahead try soak --minutes 10 --observers 8

Virtual: both cores in one process, as fast as they go. Real: both sides with a simulated person, over loopback. The
person grasps, lifts, and then rests; messages keep flowing. This process drives the observers, because one each would
be too much for two cores.

The summaries' statistics keep up to 100 000 samples each: 0.8 MB for each over the first minutes. The limit allows it.
"""

import secrets
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import tyro
from msgspec import Meta
from rich.console import RenderableType
from rich.text import Text

from common.clock import MonotonicClock, clock_domain
from common.emulation.spec import LinkSpec
from common.sockets.operator import OperatorSockets
from common.status.codes import LinkState
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from feelahead.both_sides.memory import descriptors, resident_mb
from feelahead.both_sides.processes import SideFailedError, SideProcess
from feelahead.both_sides.real_time import LINK_S, START_S, end, started
from feelahead.both_sides.summary import merge_summaries
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep, cell_of
from feelahead.lab.table import Row, Table
from operator_side.core import OperatorSide
from operator_side.settings import OperatorSettings
from robot_side.operators.lease import MOST_OBSERVERS
from robot_side.settings import RobotSettings

SAMPLES: Final = 20
_SETTLED: Final = 0.1
"""The first tenth of the run fills what is bounded: it counts as the start from then on."""
_FLAT_MB: Final = 10.0
_LIGHT: Final = "this process"
"""The row of the observers."""
_ROBOT: Final = "robot side"
_OWNER: Final = "operator side"
_PERIOD_S: Final = 0.02
"""The robot side tells observers as often what they may feel."""
_GAP: Final = "no command for"


@dataclass(frozen=True)
class Soak:
    """One run."""

    minutes: Annotated[float, Meta(gt=0.0, le=1440.0), tyro.conf.arg(metavar="N")] = 2.0
    """Length, in the time of the run."""
    virtual: bool = False
    """In virtual time, in one process."""
    observers: Annotated[int, Meta(ge=0, le=MOST_OBSERVERS), tyro.conf.arg(metavar="N")] = 0
    """Number of others that watch, from within this process."""
    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = "delay 20ms 5ms"
    """Emulated link, in netem's words."""


@dataclass(frozen=True)
class SoakSweep(Soak, Sweep):
    """Run both sides for a while, and tell whether memory and descriptors stay flat."""

    def __post_init__(self) -> None:
        super().__post_init__()
        LinkSpec.parse(self.link, 0)
        if self.observers and self.virtual:
            raise ValueError(f"--observers {self.observers} with --virtual: valid: one of them")


def cells(settings: SoakSweep) -> Iterator[Soak]:
    """Lay out the one run."""
    soak = cell_of(Soak, settings)
    yield replace(soak, minutes=min(soak.minutes, 0.2)) if settings.quick else soak


def run(cell: Soak, seed: int) -> Iterator[Row]:
    """Soak; yield memory and descriptors of each process at even times, and a row for the end."""
    samples: dict[str, list[Row]] = {}
    for row in _virtual(cell, seed) if cell.virtual else _real(cell, seed):
        if "process" in row:
            samples.setdefault(row["process"], []).append(row)
        if "stops" in row:
            row["flat"] = all(flat(rows, cell.observers if name == _LIGHT else 1) for name, rows in samples.items())
        yield row


def _virtual(cell: Soak, seed: int) -> Iterator[Row]:
    sides = RobotSettings(link=cell.link, seed=seed), OperatorSettings(link=cell.link, seed=seed)
    both = Loopback(LoopbackSettings(*sides))
    for step in range(SAMPLES + 1):
        minutes = cell.minutes * step / SAMPLES
        both.run_until(60.0 * minutes)
        yield _sample("both sides", "self", minutes)
    yield _end(both.summary() | {"errors": []})


def _real(cell: Soak, seed: int) -> Iterator[Row]:
    own = [f"--seed={seed}", f"--link={cell.link}"]
    with started(own, own) as both, ExitStack() as stack:
        while both.operator.wait_for("status", START_S).get("link") != LinkState.UP:
            both.robot.check()
        sides = _Running(both.robot, both.operator)
        sides.bring(
            [
                (
                    stack.enter_context(OperatorSockets(both.control, both.view)),
                    OperatorSide(secrets.randbits(53), clock_domain(), haptics=False),
                )
                for _ in range(cell.observers)
            ]
        )
        for step in range(SAMPLES + 1):
            minutes = cell.minutes * step / SAMPLES
            if step:
                sides.wait(60.0 * cell.minutes / SAMPLES)
            yield _sample(_ROBOT, both.robot.process_id, minutes)
            yield _sample(_OWNER, both.operator.process_id, minutes)
            if cell.observers:
                yield _sample(_LIGHT, "self", minutes)
        end(both.robot, both.operator)
        yield _end(merge_summaries(*both.summaries(), []))


def _sample(process: str, number: int | str, minutes: float) -> Row:
    return {"process": process, "at_min": minutes, "mb": resident_mb(number), "descriptors": descriptors(number)}


def _end(summary: dict[str, Any]) -> Row:
    reasons = Counter("gap" if stop["reason"].startswith(_GAP) else stop["reason"] for stop in summary["stops"])
    delay_ms = {f"{way}_p99_ms": summary["delay_ms"][way]["p99"] for way in ("to_operator", "to_robot")}
    counts = {"stops": sum(reasons.values()), "errors": len(summary["errors"])}
    return counts | delay_ms | {"messages": summary["messages"], "why": dict(reasons), "said": summary["errors"]}


class _Running:
    """Both sides' processes, and observers within this one."""

    def __init__(self, robot: SideProcess, owner: SideProcess) -> None:
        self.watching = 0
        """Number of observers that the robot side spoke of last."""
        self._robot, self._owner = robot, owner
        self._clock, self._pause = MonotonicClock(), threading.Event()
        self._observers: Sequence[tuple[OperatorSockets, OperatorSide]] = ()

    def bring(self, observers: Sequence[tuple[OperatorSockets, OperatorSide]]) -> None:
        """Wait until the robot side has taken all of them in; SideFailedError when it does not."""
        self._observers = observers
        end_s = self._clock.now() + LINK_S
        while self.watching < len(observers) or any(side.lease is None or side.screen is None for _, side in observers):
            if self._clock.now() > end_s:
                raise SideFailedError(f"the robot side knows of {self.watching} observers after {LINK_S:g} s")
            self.wait(_PERIOD_S)

    def wait(self, seconds: float) -> None:
        """Let time pass while all take their turns; SideFailedError when a side fails."""
        end_s = self._clock.now() + seconds
        while (now_s := self._clock.now()) < end_s:
            for sockets, core in self._observers:
                for payload in sockets.receive():
                    core.receive(payload, now_s)
                for _, payload in sockets.receive_view():
                    core.receive_view(payload, now_s)
                for message in core.motion(now_s):
                    sockets.send(message.payload, everywhere=message.everywhere)
            self._owner.check()
            self._owner.events()
            self._robot.check()
            for event in self._robot.events():
                if event["event"] == "status":
                    self.watching = event["observers"]
            self._pause.wait(min(end_s - now_s, _PERIOD_S))


def flat(samples: Sequence[Row], sides: int = 1) -> bool:
    """Say whether memory and descriptors stay flat, from the settled start to the end.

    Flat: memory grew by less than 10 MB for each of the `sides` in the process, and descriptors not at all.
    """
    settled, last = samples[int(_SETTLED * len(samples))], samples[-1]
    return bool(last["mb"] - settled["mb"] < sides * _FLAT_MB and last["descriptors"] <= settled["descriptors"])


def show(_settings: SoakSweep, table: Table) -> Iterator[RenderableType]:
    """Show start, settled, middle and end of each process, then the rest in words."""
    lines: list[list[Any]] = []
    for _, rows in Table(row for row in table if "process" in row).groups("seed", "process"):
        all_of = list(rows.lines("process", "at_min", "mb", "descriptors"))
        lines += [all_of[index] for index in (0, int(_SETTLED * len(rows)), len(rows) // 2, len(rows) - 1)]
    yield shown("soak", ("process", "at, min", "resident, MB", "descriptors"), lines)
    for row in table:
        if "messages" in row:
            stops = ", ".join(f"{count} x {reason}" for reason, count in row["why"].items()) or "none"
            yield Text(f"messages {row['messages']}")
            yield Text(f"stops: {stops}; errors: {row['said'] or 'none'}")
            yield Text("flat" if row["flat"] else "NOT FLAT")


def failed(row: Row) -> bool:
    """Recognise a run in which something grew or failed."""
    return bool(row.get("errors")) or row.get("flat") is False


QUESTION = Question("try soak", SoakSweep, cells, run, show, failed=failed, timed=True)
