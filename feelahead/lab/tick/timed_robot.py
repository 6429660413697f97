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
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Final, get_args

import numpy as np
import tyro

import robot_side.main
from common.command.command_line import parse_settings, run_command
from feelahead.lab.tick.crowd import CrowdedCamera
from feelahead.lab.tick.mixed import Mixed
from robot_side.core import RobotParts, RobotSide
from robot_side.events import Listener, Step
from robot_side.reporting.outgoing_messages import Outgoing

PROGRAM: Final = "feelahead.lab.tick.timed_robot"
STAGES: Final = ("physics", "look", "frame", "law", "motion", "figures", "message")
OUTSIDE: Final = ("physics", "frame")
"""No part of the way from look to message: a real arm has no physics, and frames are taken in after the messages."""
_OF_STEPS: Final[dict[Step, str]] = {
    "arm": "physics",
    "pose": "look",
    "frame": "frame",
    "law": "law",
    "motion": "motion",
    "listeners": "figures",
    "messages": "message",
}
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


class StepTimes(Listener):
    """Adds up the processor time of each stage."""

    def __init__(self, *, all_stages: bool) -> None:
        """all_stages: or else those alone that are no part of look to message."""
        self.steps = get_args(Step) if all_stages else ("arm", "pose", "frame", "end")
        self.took_s = np.zeros(len(STAGES))
        self._places = {
            step: STAGES.index(stage) for step, stage in _OF_STEPS.items() if all_stages or stage in OUTSIDE
        }
        self._place: int | None = None
        self._began_s = 0.0

    def on_step(self, step: Step) -> None:
        """End the stage before, and begin the step's."""
        place = self._places.get(step)
        if place is None and self._place is None:
            return
        now_s = time.thread_time()
        if self._place is not None:
            self.took_s[self._place] += now_s - self._began_s
        self._place, self._began_s = place, now_s


class RobotInTurns(RobotSide):
    """A core that does "mixed" in the place of some ticks, and adds a row for each turn that counts."""

    def __init__(
        self, parts: RobotParts, listeners: Sequence[Listener], settings: TimedSettings, ticks: list[tuple[float, ...]]
    ) -> None:
        if settings.objects or settings.only:
            parts = replace(parts, camera=CrowdedCamera(parts.camera, settings.objects, only=settings.only))
        self._times, self._mixed, self._turns = StepTimes(all_stages=settings.stages), Mixed(), itertools.count()
        self._rows, self._last = ticks, list[float]()
        super().__init__(parts, [*listeners, self._times])

    def tick(self, now_s: float) -> list[Outgoing]:
        """Tick, or do the other work."""
        if self._last:  # Only now is it known what came after its messages.
            self._rows.append((*self._last, *self._times.took_s.tolist()))
            self._last.clear()
        self._times.took_s[:] = 0.0
        (round_, turn), began_wall_s = divmod(next(self._turns), _TURNS), time.perf_counter()
        looks, outgoing = self._looks(), list[Outgoing]()
        began_s = time.thread_time()
        if turn < _MIXED:
            self._mixed.work()
        else:
            outgoing = super().tick(now_s)
        ended_s = time.thread_time()
        if turn not in _UNCOUNTED:
            wall_s, looks = time.perf_counter() - began_wall_s, self._looks() - looks
            self._last[:] = now_s, 2 * round_ + (turn < _MIXED), ended_s - began_s, ended_s, wall_s, looks
        return outgoing

    def _looks(self) -> int:
        return self.parts.law.summary().get("fields", 0)


def command(arguments: Sequence[str]) -> int:
    """Run the robot side's own command with a timed core."""
    ours = tuple(f"--{one.name}=" for one in fields(TimedSettings))
    mine = [argument for argument in arguments if argument.startswith(ours)]
    settings = parse_settings(TimedSettings, PROGRAM, mine)
    ticks: list[tuple[float, ...]] = []
    others = [argument for argument in arguments if argument not in mine]
    try:
        return robot_side.main.command(others, lambda parts, listeners: RobotInTurns(parts, listeners, settings, ticks))
    finally:
        np.save(settings.log, np.array(ticks).reshape(-1, len(COLUMNS)))


if __name__ == "__main__":
    run_command(PROGRAM, command)
