"""feelahead-robot with its arm and its judgement watched: events go to a log, line by line.

    python -m feelahead.lab.faults.watched_robot --log=FILE [flags of feelahead-robot]

Lines: {"deceleration", "after"}: when the arm slowed down, and how long after the newest command was accepted, by the
arm's own measurement; {"stop", "why", "after"}: when the robot side disarmed, and how long after it; and
{"figures", "time"}: counters, ten times a second. Times in seconds of the monotonic clock.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

import robot_side.main
from common.command.command_line import run_command
from common.errors import ConfigurationError
from common.protocol.link_end import Arrival
from common.protocol.messages import MotionCommand
from feelahead.lab.faults.watched_arm import WatchedArm
from robot_side.arm.port import Arm, ArmState
from robot_side.assembly import Assembled, assemble
from robot_side.core import RobotSide
from robot_side.settings import RobotSettings

PROGRAM = "feelahead.lab.faults.watched_robot"
_PERIOD_S = 0.1
_PAUSE_S = 0.5
"""A tick as late as this means that this process stood still."""


class _LoggedArm(WatchedArm):
    """Writes down what is new after each state, which the core asks for once a tick."""

    def __init__(self, arm: Arm, gap_s: float, log: TextIO) -> None:
        super().__init__(arm, gap_s)
        self.core: RobotSide | None = None
        self.oldest_accepted_s = 0.0
        self.epochs: set[int] = set()
        self._log = log
        self._stops = self._told_at_pause = 0
        self._ticked_s = self._next_s = 0.0

    def state(self, now_s: float) -> ArmState:
        """Do as the arm does."""
        state = super().state(now_s)
        if self.core is not None:
            self._ticked(self.core, now_s)
        return state

    def _ticked(self, core: RobotSide, now_s: float) -> None:
        if now_s - self._ticked_s > _PAUSE_S:
            self._told_at_pause = self.told_to_move
        self._ticked_s = now_s
        while self.decelerations:
            one = self.decelerations.popleft()
            self._write(deceleration=one.time_s, after=one.after_s)
        stops = core.session.safety.stops
        for when_s, why in list(stops)[self._stops :]:
            self._write(stop=when_s, why=why, after=when_s - self.accepted_s)
        self._stops = len(stops)
        if now_s >= self._next_s:
            self._next_s = now_s + _PERIOD_S
            self._write(figures=self._figures(core), time=now_s)

    def _figures(self, core: RobotSide) -> dict[str, Any]:
        return core.session.summary() | {
            "state": core.session.safety.state,
            "rejected": core.session.rejected,
            "oldest_accepted_s": self.oldest_accepted_s,
            "epochs_applied": len(self.epochs),
            "told_to_move": self.told_to_move,
            "told_since_pause": self.told_to_move - self._told_at_pause,
            "speed_rad_s": self.speeds_rad_s[-1][1] if self.speeds_rad_s else 0.0,
        }

    def _write(self, **line: Any) -> None:
        self._log.write(json.dumps(line) + "\n")
        self._log.flush()


def _watched(log: TextIO) -> Callable[..., Assembled]:
    """Make an `assemble` whose arm and whose acceptance of commands are watched."""

    def build(
        settings: RobotSettings, epoch: int, clock_domain: str, *, watch: Callable[[Arm], Arm], **given: Any
    ) -> Assembled:
        arms: list[_LoggedArm] = []

        def logged(arm: Arm) -> Arm:
            arms.append(_LoggedArm(watch(arm), settings.safety.gap_s, log))
            return arms[0]

        assembled = assemble(settings, epoch, clock_domain, logged, **given)
        [arm], safety = arms, assembled.core.session.safety
        arm.core = assembled.core
        receive = safety.receive

        def noted(command: MotionCommand, arrival: Arrival, now_s: float) -> bool:
            accepted = receive(command, arrival, now_s)
            if accepted:
                arm.oldest_accepted_s = max(arm.oldest_accepted_s, arrival.queueing_age_s)
                arm.epochs.add(command.header.epoch)
            return accepted

        safety.receive = noted  # type: ignore[method-assign]
        return assembled

    return build


def command(arguments: list[str]) -> int:
    """Run the robot side's own command with a watched assembly."""
    own = [argument for argument in arguments if argument.startswith("--log=")]
    if len(own) != 1:
        raise ConfigurationError("--log: missing; valid: --log=FILE, once")
    with Path(own[0].removeprefix("--log=")).open("w", encoding="utf-8") as log:
        robot_side.main.assemble = _watched(log)  # type: ignore[attr-defined]
        return robot_side.main.command([argument for argument in arguments if argument not in own])


if __name__ == "__main__":
    run_command(PROGRAM, lambda arguments: command(list(arguments)))
