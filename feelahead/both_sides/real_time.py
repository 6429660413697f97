"""Run both sides in real time, as processes on this machine or in containers."""

import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from common.clock import MonotonicClock
from common.errors import FeelaheadError
from common.status.codes import LinkState
from feelahead.both_sides.processes import SideProcess, StartedSide
from feelahead.both_sides.summary import read_summary

START_S: Final = 600.0
"""Time limit for a side to start, in seconds: the first start compiles kernels, for minutes on a busy machine."""
LINK_S: Final = 30.0
"""Time limit for the link to come up, in seconds."""
_PAUSE_S: Final = 0.1


class Both(NamedTuple):
    """Running processes of both sides, and the robot side's addresses."""

    robot: SideProcess
    operator: SideProcess
    control: str
    """Address of the robot side's control port"""
    view: str
    """Address of the robot side's view port"""
    folder: Path
    """Folder of both summaries"""

    def summaries(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Read the summaries that both sides have written at their end: the robot side's, and the operator side's."""
        return read_summary(self.folder / "robot.json"), read_summary(self.folder / "operator.json")


@contextmanager
def started(robot: Sequence[str], operator: Sequence[str], program: str = "robot_side") -> Iterator[Both]:
    """Start both sides on 127.0.0.1 with a simulated controller.

    robot, operator: further flags of each side. program: module to run as the robot side.
    """
    with tempfile.TemporaryDirectory(prefix="feelahead-") as name, ExitStack() as stack:
        folder = Path(name)
        ours = ["--bind=tcp://127.0.0.1:0", f"--summary={folder / 'robot.json'}", *robot]
        one = stack.enter_context(SideProcess(program, "robot", ours))
        heard = one.wait_for("listening", START_S)
        ends = [f"--connect={heard['control']}", f"--view-connect={heard['view']}", "--device=simulated"]
        theirs = [*ends, f"--summary={folder / 'operator.json'}", *operator]
        other = stack.enter_context(SideProcess("operator_side", "operator", theirs))
        yield Both(one, other, heard["control"], heard["view"], folder)


def run_for(robot: StartedSide, operator: StartedSide, duration_s: float) -> None:
    """Let both sides run for `duration_s` from when the link is up, then end them.

    Raises SideFailedError if a side fails, FeelaheadError if no link comes up or a side ends early.
    """
    clock, pause = MonotonicClock(), threading.Event()
    limit_s = clock.now() + LINK_S
    while operator.wait_for("status", LINK_S).get("link") != LinkState.UP:
        robot.check()
        if clock.now() > limit_s or not robot.running:
            raise FeelaheadError(f"no link within {LINK_S:g} s")
    end_s = clock.now() + duration_s
    while (left_s := end_s - clock.now()) > 0.0:
        pause.wait(min(left_s, _PAUSE_S))
        for side in (robot, operator):
            side.events()
            side.check()
            if not side.running:
                raise FeelaheadError(f"the {side.name} side ended early")
    end(robot, operator)


def end(robot: StartedSide, operator: StartedSide) -> None:
    """End both sides at once, so that neither reports the other's end as a fault of the link.

    Raises SideFailedError if a side ended with an error.
    """
    for side in (operator, robot):
        side.interrupt()
    for side in (operator, robot):
        side.stop()
        side.check()
