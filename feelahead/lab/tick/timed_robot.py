"""Robot side that logs the processor time of each tick: `python -m ... --log=FILE.npy` and the robot side's flags.

--objects=N adds N perceived objects without physics; --only removes the scene's own objects. --sent=once and
--sent=again perceive the N objects alone, as a process sends them: in one frame, or in frames at 10 Hz.

The reference "mixed" (see `Mixed`) is measured in the same process, at the start of 4 of every 17 ticks; these ticks do
not count. "mixed" and a tick both begin after the loop's sleep, with cold caches. (After a tick's messages "mixed" was
10 % faster, as MuJoCo's code was still in the cache.) The first of the 4 does not count, nor do the 2 ticks after them.
17 has no divisor in common with the periods of looks and frames.
"""

import itertools
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np
import tyro

import robot_side.main
from common.command.command_line import parse_settings, run_command
from feelahead.lab.tick.crowd import CrowdedCamera
from feelahead.lab.tick.mixed import Mixed
from feelahead.lab.tick.sent_crowd import SentCamera
from robot_side.core.robot_parts import RobotParts
from robot_side.laws.law import Law
from robot_side.tick.events import Listener, Step, Tick

PROGRAM: Final = "feelahead.lab.tick.timed_robot"
STAGES: Final = ("physics", "look", "frame", "law", "motion", "figures", "message")
OUTSIDE: Final = ("physics", "frame")
"""Stages that "look to message" leaves out: a real arm has no physics, and frames are read after the messages."""
_OF_STEPS: Final[dict[Step, str]] = {
    "arm": "physics",
    "pose": "look",
    "frame": "frame",
    "law": "law",
    "motion": "motion",
    "listeners": "figures",
    "messages": "message",
}
COLUMNS: Final = ("now_s", "run", "spent_s", "thread_s", "wall_s", "looks", *STAGES)
"""Columns of the log: time; number of the run of consecutive counted turns (even: ticks, odd: "mixed"); processor time
of the tick or of "mixed"; the thread's processor time at its end; wall time; number of looks in the tick; processor
time of each stage."""
_TURNS: Final = 17
_MIXED: Final = 4
_UNCOUNTED: Final = (0, _MIXED, _MIXED + 1)


@dataclass(frozen=True)
class TimedSettings:
    """Flags in addition to the robot side's."""

    log: Path = Path("ticks.npy")
    """File for the log, with a row for each counted tick, see COLUMNS."""
    objects: int = 0
    """Number of additional objects."""
    stages: tyro.conf.FlagConversionOff[bool] = True
    """Measure each stage, which itself takes some microseconds; if False, only the stages outside "look to message"."""
    only: tyro.conf.FlagConversionOff[bool] = False
    """Leave out the scene's own objects, and perceive only the additional ones."""
    sent: Literal["", "once", "again"] = ""
    """How the additional objects come as frames, if they do."""


class TimedTicks(Listener):
    """Listener that measures ticks and stages, runs "mixed" before some ticks, and stores rows of the counted ones."""

    def __init__(self, law: Law, rows: list[tuple[float, ...]], *, all_stages: bool) -> None:
        """rows: list to fill, see COLUMNS. all_stages: if False, measure only the stages outside "look to message"."""
        self.steps = get_args(Step) if all_stages else ("arm", "pose", "frame", "end")
        self._rows, self._law, self._mixed, self._turns = rows, law, Mixed(), itertools.count()
        self._stages_s = np.zeros(len(STAGES))
        self._places = {
            step: STAGES.index(stage) for step, stage in _OF_STEPS.items() if all_stages or stage in OUTSIDE
        }
        self._stage: tuple[int, float] | None = None
        self._begun: tuple[int, int, float, float] | None = None
        self._mixed_row: tuple[float, ...] = ()
        self._row: tuple[float, ...] = ()
        self._now_s = 0.0

    def on_tick(self, tick: Tick) -> None:
        """Note the time of the tick that begins."""
        self._now_s = tick.now_s

    def on_step(self, step: Step) -> None:
        """End the previous stage and begin that of `step`; a tick reaches from the step `arm` to the first `end`."""
        if step == "arm":
            self._begin()
        place = self._places.get(step)
        if place is not None or self._stage is not None:
            now_s = time.thread_time()
            if self._stage is not None:
                self._stages_s[self._stage[0]] += now_s - self._stage[1]
            self._stage = None if place is None else (place, now_s)
        if step == "end" and self._begun is not None:
            self._end(*self._begun)
            self._begun = None

    def _begin(self) -> None:
        if self._row:  # Only now is it known what came after its messages.
            self._rows.append((*self._row, *self._stages_s.tolist()))
        self._stages_s[:] = 0.0
        self._row = self._mixed_row = ()
        number = next(self._turns)
        if number % _TURNS < _MIXED:
            began_wall_s, began_s = time.perf_counter(), time.thread_time()
            self._mixed.work()
            ended_s = time.thread_time()
            self._mixed_row = ended_s - began_s, ended_s, time.perf_counter() - began_wall_s, 0.0
        self._begun = number, self._looks(), time.perf_counter(), time.thread_time()

    def _end(self, number: int, looks: int, began_wall_s: float, began_s: float) -> None:
        ended_s, (round_, turn) = time.thread_time(), divmod(number, _TURNS)
        if turn in _UNCOUNTED:
            return
        if self._mixed_row:
            self._rows.append((self._now_s, 2 * round_ + 1, *self._mixed_row, *np.zeros(len(STAGES)).tolist()))
        else:
            spent = ended_s - began_s, ended_s, time.perf_counter() - began_wall_s, self._looks() - looks
            self._row = self._now_s, 2 * round_, *spent

    def _looks(self) -> int:
        return self._law.summary().get("looks", 0)


def command(arguments: Sequence[str]) -> int:
    """Run the robot side's command with a core whose ticks are measured."""
    ours = tuple(f"--{one.name}=" for one in fields(TimedSettings))
    mine = [argument for argument in arguments if argument.startswith(ours)]
    settings = parse_settings(TimedSettings, PROGRAM, mine)
    others = [argument for argument in arguments if argument not in mine]
    rows: list[tuple[float, ...]] = []

    def adapt(parts: RobotParts) -> tuple[RobotParts, Sequence[Listener]]:
        if settings.sent:
            again = settings.sent == "again"
            parts = replace(parts, camera=SentCamera(settings.objects, parts.surroundings, again=again))
        elif settings.objects or settings.only:
            parts = replace(parts, camera=CrowdedCamera(parts.camera, settings.objects, only=settings.only))
        timed = TimedTicks(parts.law, rows, all_stages=settings.stages)
        return parts, [timed]

    try:
        return robot_side.main.command(others, adapt)
    finally:
        np.save(settings.log, np.array(rows).reshape(-1, len(COLUMNS)))


if __name__ == "__main__":
    run_command(PROGRAM, command)
