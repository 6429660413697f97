"""A robot side that writes down the cost of each tick: `python -m ... --log=FILE.npy` and its own flags.

--objects=N puts N more perceived objects around, which physics knows nothing of; --only takes the scene's own away.

The peer "mixed" (see `Mixed`) is measured here, too, in the place of 4 ticks of each 17. Its turns are paced by the
loop as ticks are, after the same sleep. What a turn reads was last read a millisecond before, by the turn before it:
that makes a tick cold, and so the first of the 4 does not count. Run beside a tick, after its messages have left, it
was 10 % faster: MuJoCo's code was still warm. The arm follows its command for 100 ms and notices nothing of 4. The
next 2 ticks do not count: they catch up with the physics. 17 is prime to the periods of looks and frames.
"""

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np
import tyro

import robot_side.main
from common.command.command_line import parse_settings, run_command
from feelahead.lab.tick.crowd import CrowdedCamera
from feelahead.lab.tick.mixed import Mixed
from robot_side.assembly import Assembled, assemble
from robot_side.outgoing_messages import Outgoing

PROGRAM: Final = "feelahead.lab.tick.timed_robot"
STAGES: Final = ("physics", "look", "frame", "law", "motion", "figures", "message")
OUTSIDE: Final = ("physics", "frame")
"""No part of the way from look to message: a real arm has no physics, and frames are taken in after the messages."""
_PLACES: Final = (
    ("_arm", "state"),
    ("_kinematics", "pose"),
    ("", "see"),
    ("_law", "sense"),
    ("", "_move"),
    ("", "_record"),
    ("", "_outgoing"),
)
COLUMNS: Final = ("now_s", "run", "tick_s", "thread_s", "wall_s", "looks", *STAGES)
"""Columns of the log: time, the run of turns that count (even: ticks, odd: "mixed"), the turn's processor time, the
thread's until then, the turn's wall time, how many looks the tick began, each stage's processor time."""
_TURNS: Final = 17
_MIXED: Final = 4
_UNCOUNTED: Final = (0, _MIXED, _MIXED + 1)


@dataclass(frozen=True)
class TimedSettings:
    """Flags besides the robot side's."""

    log: Path = Path("ticks.npy")
    """The file for the figures: a row a tick, see COLUMNS."""
    objects: int = 0
    """Number of further objects."""
    stages: tyro.conf.FlagConversionOff[bool] = True
    """Each is timed, which itself takes some microseconds; else those alone that are no part of look to message."""
    only: tyro.conf.FlagConversionOff[bool] = False
    """Leave out the scene's own."""


def command(arguments: Sequence[str]) -> int:
    """Run the robot side's own command with a timed core."""
    ours = tuple(f"--{one.name}=" for one in fields(TimedSettings))
    mine = [argument for argument in arguments if argument.startswith(ours)]
    settings = parse_settings(TimedSettings, PROGRAM, mine)
    ticks: list[tuple[float, ...]] = []
    robot_side.main.assemble = _timed(settings, ticks)  # type: ignore[assignment,attr-defined]
    try:
        return robot_side.main.command([argument for argument in arguments if argument not in mine])
    finally:
        np.save(settings.log, np.array(ticks).reshape(-1, len(COLUMNS)))


def _timed(settings: TimedSettings, ticks: list[tuple[float, ...]]) -> object:
    """Make an `assemble` whose core adds a row with each tick."""

    def build(*arguments: object, **others: object) -> Assembled:
        assembled = assemble(*arguments, **others)  # type: ignore[arg-type]
        core = assembled.core
        if settings.objects or settings.only:
            core._camera = CrowdedCamera(core._camera, settings.objects, only=settings.only)
        took_s = np.zeros(len(STAGES))
        for stage, (part, name) in enumerate(_PLACES):
            if settings.stages or STAGES[stage] in OUTSIDE:
                _time(getattr(core, part) if part else core, name, took_s, stage)
        tick, mixed, turns = core.tick, Mixed(), itertools.count()
        last: list[float] = []

        def timed(now_s: float) -> list[Outgoing]:
            if last:  # Only now is it known what came after its messages.
                ticks.append((*last, *took_s.tolist()))
                last.clear()
            took_s[:] = 0.0
            (round_, turn), began_wall_s = divmod(next(turns), _TURNS), time.perf_counter()
            looks, outgoing = core._law.summary().get("fields", 0), []
            began_s = time.thread_time()
            if turn < _MIXED:
                mixed.work()
            else:
                outgoing = tick(now_s)
            ended_s = time.thread_time()
            if turn not in _UNCOUNTED:
                wall_s, looks = time.perf_counter() - began_wall_s, core._law.summary().get("fields", 0) - looks
                last[:] = now_s, 2 * round_ + (turn < _MIXED), ended_s - began_s, ended_s, wall_s, looks
            return outgoing

        core.tick = timed  # type: ignore[method-assign]
        return assembled

    return build


def _time(owner: Any, name: str, took_s: Any, stage: int) -> None:
    """Let a method of one object add its processor time."""
    method: Callable[..., Any] = getattr(owner, name)

    def timed(*arguments: Any, **others: Any) -> Any:
        began_s = time.thread_time()
        result = method(*arguments, **others)
        took_s[stage] += time.thread_time() - began_s
        return result

    setattr(owner, name, timed)


if __name__ == "__main__":
    run_command(PROGRAM, command)
