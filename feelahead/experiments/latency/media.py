"""The media that are always there: virtual time in this process, and two processes on this machine."""

import tempfile
from pathlib import Path
from typing import Final

from common.command.live_view import LINK_UP
from common.errors import FeelaheadError
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.real_time import LINK_S, START_S, run_for
from feelahead.both_sides.summary import merge_summaries, read_summary
from feelahead.both_sides.trial import Trial, TrialFigures, figures_of

_LOOK_S: Final = 0.01


class VirtualMedium:
    """Both cores, emulated links and a virtual clock in this process: the same trial gives the same figures."""

    name = "virtual"

    def run(self, trial: Trial) -> TrialFigures:
        """Do it, as fast as the machine can."""
        run = Loopback(LoopbackSettings(trial.robot_settings(), trial.operator_settings()))
        while run.operator.status(run.clock.now())["link"] != LINK_UP:
            if run.clock.now() > LINK_S:
                raise FeelaheadError(f"no link within {LINK_S:g} s over --link {trial.link!r}")
            run.run_until(run.clock.now() + _LOOK_S)
        run.run_until(run.clock.now() + trial.duration_s)
        return figures_of(run.summary())


class LoopbackMedium:
    """Both sides as processes on 127.0.0.1, each of which emulates the link for what it sends."""

    name = "loopback"

    def run(self, trial: Trial) -> TrialFigures:
        """Do it in real time; SideFailedError where a side fails."""
        with tempfile.TemporaryDirectory(prefix="feelahead-latency-") as folder:
            summaries = {side: Path(folder) / f"{side}.json" for side in ("robot", "operator")}
            link = trial.link_arguments()
            robot_arguments = [*trial.robot_arguments(), *link, f"--summary={summaries['robot']}"]
            with SideProcess("robot_side", "robot", ["--bind=tcp://127.0.0.1:0", *robot_arguments]) as robot:
                heard = robot.wait_for("listening", START_S)
                addresses = [f"--connect={heard['control']}", f"--view-connect={heard['view']}"]
                operator_arguments = [*trial.operator_arguments(), *link, f"--summary={summaries['operator']}"]
                with SideProcess("operator_side", "operator", [*addresses, *operator_arguments]) as operator:
                    run_for(robot, operator, trial.duration_s)
            robot_said, operator_said = (read_summary(path) for path in summaries.values())
            return figures_of(merge_summaries(robot_said, operator_said, []))
