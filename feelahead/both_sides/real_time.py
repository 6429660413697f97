"""Both sides in real time, as processes anywhere: from the start of the link to the end."""

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
"""Time limit of a start, in seconds: the first one compiles kernels, which takes minutes on a busy machine."""
LINK_S: Final = 30.0
"""Time limit for the link to come up, in seconds."""
_PAUSE_S: Final = 0.1


class Both(NamedTuple):
    """Both sides' processes."""

    robot: SideProcess
    operator: SideProcess
    control: str
    view: str
    """Both are addresses of the robot side."""
    folder: Path

    def summaries(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Read the summaries that both have written at the end."""
        return read_summary(self.folder / "robot.json"), read_summary(self.folder / "operator.json")


@contextmanager
def started(robot: Sequence[str], operator: Sequence[str], program: str = "robot_side") -> Iterator[Both]:
    """Start both on 127.0.0.1 with these flags and a simulated controller; `program`: the robot side's module."""
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
    """Run both for `duration_s` once the link is up, then end them; raises SideFailedError if one fails."""
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
    """End both at once, so that neither takes the other's end for a link fault; raises SideFailedError if one fails."""
    for side in (operator, robot):
        side.interrupt()
    for side in (operator, robot):
        side.stop()
        side.check()
