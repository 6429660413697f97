"""Both sides in real time, in processes anywhere: from the link's coming up to their end."""

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
"""The first start compiles kernels, which a busy machine takes minutes for."""
LINK_S: Final = 30.0
"""Within which a link has to come up."""
_PAUSE_S: Final = 0.1


class Both(NamedTuple):
    """Both sides' processes."""

    robot: SideProcess
    operator: SideProcess
    control: str
    view: str
    """The robot side's two addresses."""
    folder: Path

    def summaries(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Read what each has written at its end."""
        return read_summary(self.folder / "robot.json"), read_summary(self.folder / "operator.json")


@contextmanager
def started(robot: Sequence[str], operator: Sequence[str], program: str = "robot_side") -> Iterator[Both]:
    """Start both on 127.0.0.1 with these flags and a simulated controller; `program` is the robot side's module."""
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
    """Let them run for `duration_s` once their link is up, and end both; SideFailedError where one fails."""
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
    """End both at once, lest one takes the other's end for a fault of the link; SideFailedError where one fails."""
    for side in (operator, robot):
        side.interrupt()
    for side in (operator, robot):
        side.stop()
        side.check()
