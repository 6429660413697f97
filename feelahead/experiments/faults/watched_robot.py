"""feelahead-robot with its arm and its judgement watched: what happens goes to a log, line by line.

    python -m feelahead.experiments.faults.watched_robot --log=FILE [flags of feelahead-robot]

Lines: {"deceleration", "after"}: when the arm slowed down, and how long after the newest command was accepted, by
the arm's own measurement; {"stop", "why", "after"}: when the robot side disarmed, and how long after it; and
{"figures"}: counters, ten times a second. Times in seconds of the monotonic clock.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

import numpy as np

import robot_side.main
from common.clock import MonotonicClock
from common.command.command_line import run_command
from common.errors import ConfigurationError
from common.protocol.link_end import Arrival
from common.protocol.messages import MotionCommand
from common.sockets.admission import Admission
from feelahead.experiments.faults.watched_arm import WatchedArm
from robot_side.arm.port import Arm, ArmState
from robot_side.assembly import Assembled, assemble
from robot_side.core import RobotSide
from robot_side.outgoing_messages import Outgoing
from robot_side.settings import RobotSettings

PROGRAM = "python -m feelahead.experiments.faults.watched_robot"
_PERIOD_S = 0.1
_PAUSE_S = 0.5
"""A tick so late means that this process stood still."""


class Watch:
    """Writes down what it sees of one robot side."""

    def __init__(self, log: TextIO) -> None:
        self._log = log
        self._core: RobotSide | None = None
        self._previous_s = self._accepted_s = 0.0
        self._oldest_s = 0.0
        self._last_order = (0, 0)
        self._epochs: set[int] = set()
        self.admission = Admission()
        self._out_of_order = 0
        self._stops = 0
        self._next_s = 0.0
        self._ticks_s: list[float] = []
        self._ticked_s = 0.0
        self._told_at_pause = 0

    def build(
        self,
        settings: RobotSettings,
        epoch: int,
        clock_domain: str,
        *,
        watch: Callable[[Arm], Arm],
        **given: Any,
    ) -> Assembled:
        """As robot_side.assembly's, watched."""
        assembled = assemble(
            settings,
            epoch,
            clock_domain,
            lambda arm: _ToldArm(watch(arm), settings.safety.gap_s, self),
            **given,
        )
        self._core = core = assembled.core
        receive = core.session.safety.receive

        def judged(command: MotionCommand, arrival: Arrival, now_s: float) -> bool:
            accepted = receive(command, arrival, now_s)
            if accepted:
                self._accepted(command, arrival, now_s)
            return accepted

        tick, clock = core.tick, MonotonicClock()

        def timed(now_s: float) -> list[Outgoing]:
            began_s = clock.now()
            outgoing = tick(now_s)
            self._ticks_s.append(clock.now() - began_s)
            return outgoing

        core.session.safety.receive = judged  # type: ignore[method-assign]
        core.tick = timed  # type: ignore[method-assign]
        return assembled

    def ticked(self, arm: WatchedArm, now_s: float) -> None:
        """Write down what is new."""
        if now_s - self._ticked_s > _PAUSE_S:
            self._told_at_pause = arm.told_to_move
        self._ticked_s = now_s
        while arm.decelerations:
            one = arm.decelerations.popleft()
            self._write(deceleration=one.time_s, after=one.after_s)
        core = self._core
        if core is None:
            return
        stops = core.session.safety.stops
        for when_s, why in list(stops)[self._stops :]:
            # What was accepted in the very moment of the stop came after it.
            accepted_s = self._accepted_s if self._accepted_s < when_s else self._previous_s
            self._write(stop=when_s, why=why, after=when_s - accepted_s)
        self._stops = len(stops)
        if now_s >= self._next_s:
            self._next_s = now_s + _PERIOD_S
            self._write(figures=self._figures(core, arm), time=now_s)

    def _accepted(self, command: MotionCommand, arrival: Arrival, now_s: float) -> None:
        self._previous_s, self._accepted_s = self._accepted_s, now_s
        self._oldest_s = max(self._oldest_s, arrival.queueing_age_s)
        order = (command.header.epoch, command.header.sequence)
        self._out_of_order += order[0] == self._last_order[0] and order[1] <= self._last_order[1]
        self._last_order = order
        self._epochs.add(order[0])

    def _figures(self, core: RobotSide, arm: WatchedArm) -> dict[str, Any]:
        tick_p99_us = 1e6 * float(np.quantile(self._ticks_s, 0.99)) if self._ticks_s else 0.0
        self._ticks_s.clear()
        speed = arm.speeds_rad_s[-1][1] if arm.speeds_rad_s else 0.0
        return core.session.summary() | {
            "state": core.session.safety.state,
            "oldest_accepted_s": self._oldest_s,
            "out_of_order": self._out_of_order,
            "epochs_applied": len(self._epochs),
            "told_to_move": arm.told_to_move,
            "told_since_pause": arm.told_to_move - self._told_at_pause,
            "not_finite": arm.not_finite,
            "speed_rad_s": speed,
            "tick_p99_us": tick_p99_us,
            "rejected": core.session.rejected,
            "unread": self.admission.unread,
            "motion_received": core.session.motion_received,
        }

    def _write(self, **line: Any) -> None:
        self._log.write(json.dumps(line) + "\n")
        self._log.flush()


class _ToldArm(WatchedArm):
    """Tells the watch after each state."""

    def __init__(self, arm: Arm, gap_s: float, watch: Watch) -> None:
        super().__init__(arm, gap_s)
        self._watched_by = watch

    def state(self, now_s: float) -> ArmState:
        state = super().state(now_s)
        self._watched_by.ticked(self, now_s)
        return state


def main() -> None:
    """Run the robot side's own command with a watched assembly."""

    def command(arguments: list[str]) -> int:
        # SideProcess puts its own flags first.
        own = [argument for argument in arguments if argument.startswith("--log=")]
        if len(own) != 1:
            raise ConfigurationError("--log: missing; valid: --log=FILE, once")
        with Path(own[0].removeprefix("--log=")).open("w", encoding="utf-8") as log:
            watched = Watch(log)
            robot_side.main.assemble = watched.build  # type: ignore[assignment,attr-defined]
            robot_side.main.Admission = lambda: watched.admission  # type: ignore[assignment,attr-defined]
            return robot_side.main.command([argument for argument in arguments if argument not in own])

    run_command(PROGRAM, lambda arguments: command(list(arguments)))


if __name__ == "__main__":
    main()
