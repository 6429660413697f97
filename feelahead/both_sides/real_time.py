"""Both sides as they run in real time, wherever their processes are: from the link's coming up to their end."""

import threading
from typing import Final

from common.clock import MonotonicClock
from common.command.live_view import LINK_UP
from common.errors import FeelaheadError
from feelahead.both_sides.processes import StartedSide

START_S: Final = 600.0
"""The first start compiles kernels, which a busy machine takes minutes for."""
LINK_S: Final = 30.0
"""Within which a link has to come up."""
_PAUSE_S: Final = 0.1


def run_for(robot: StartedSide, operator: StartedSide, duration_s: float) -> None:
    """Let them run for so long once their link is up, and end both; SideFailedError where one fails."""
    clock, pause = MonotonicClock(), threading.Event()
    limit_s = clock.now() + LINK_S
    while operator.wait_for("status", LINK_S).get("link") != LINK_UP:
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
    # Both at once: neither is to take the other's end for a fault of the link.
    operator.interrupt()
    robot.interrupt()
    for side in (operator, robot):
        side.stop()
        side.check()
