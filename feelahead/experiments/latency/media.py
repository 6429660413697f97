"""The media that are always there: virtual time in this process, and two processes on this machine."""

import tempfile
import threading
from pathlib import Path
from typing import Final

from common.clock import MonotonicClock
from common.command.live_view import LINK_UP
from common.errors import FeelaheadError
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.summary import merge_summaries, read_summary
from feelahead.both_sides.trial import Trial, TrialFigures, figures_of

_START_S: Final = 600.0
"""The first start compiles kernels, which a busy machine takes minutes for."""
_LINK_S: Final = 30.0
_LOOK_S: Final = 0.01
_PAUSE_S: Final = 0.1


class VirtualMedium:
    """Both cores, emulated links and a virtual clock in this process: the same trial gives the same figures."""

    name = "virtual"

    def run(self, trial: Trial) -> TrialFigures:
        """Do it, as fast as the machine can."""
        run = Loopback(LoopbackSettings(trial.robot_settings(), trial.operator_settings()))
        while run.operator.status(run.clock.now())["link"] != LINK_UP:
            if run.clock.now() > _LINK_S:
                raise FeelaheadError(f"no link within {_LINK_S:g} s over --link {trial.link!r}")
            run.run_until(run.clock.now() + _LOOK_S)
        run.run_until(run.clock.now() + trial.duration_s)
        return figures_of(run.summary())


class LoopbackMedium:
    """Both sides as processes on 127.0.0.1, each of which emulates the link for what it sends."""

    name = "loopback"

    def __init__(self) -> None:
        self._clock, self._pause = MonotonicClock(), threading.Event()

    def run(self, trial: Trial) -> TrialFigures:
        """Do it in real time; SideFailedError where a side fails."""
        with tempfile.TemporaryDirectory(prefix="feelahead-latency-") as folder:
            summaries = {side: Path(folder) / f"{side}.json" for side in ("robot", "operator")}
            link = trial.link_arguments()
            robot_arguments = [*trial.robot_arguments(), *link, f"--summary={summaries['robot']}"]
            with SideProcess("robot_side", "robot", ["--bind=tcp://127.0.0.1:0", *robot_arguments]) as robot:
                heard = robot.wait_for("listening", _START_S)
                addresses = [f"--connect={heard['control']}", f"--view-connect={heard['view']}"]
                operator_arguments = [*trial.operator_arguments(), *link, f"--summary={summaries['operator']}"]
                with SideProcess("operator_side", "operator", [*addresses, *operator_arguments]) as operator:
                    self._watch(robot, operator, trial)
                    # Both at once: neither is to take the other's end for a fault of the link.
                    operator.interrupt()
                    robot.interrupt()
                    for side in (operator, robot):
                        side.stop()
                        side.check()
            robot_said, operator_said = (read_summary(path) for path in summaries.values())
            return figures_of(merge_summaries(robot_said, operator_said, []))

    def _watch(self, robot: SideProcess, operator: SideProcess, trial: Trial) -> None:
        while operator.wait_for("status", _LINK_S).get("link") != LINK_UP:
            pass
        end_s = self._clock.now() + trial.duration_s
        while (left_s := end_s - self._clock.now()) > 0.0:
            self._pause.wait(min(left_s, _PAUSE_S))
            for side in (robot, operator):
                side.events()
                side.check()
                if not side.running:
                    raise FeelaheadError(f"the {side.name} side ended early")
