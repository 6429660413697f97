"""A robot side that writes down what each of its ticks cost: `python -m ... --log=FILE.npy` and its own flags.

With `--record` it notes what happens and makes pictures only while somebody looks: the other turns pay for neither.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import robot_side.main
from common.command.command_line import run_command
from common.errors import ConfigurationError
from robot_side.assembly import Assembled, assemble
from robot_side.core import RobotSide
from robot_side.looking import Looking
from robot_side.outgoing_messages import Outgoing

PROGRAM = "python -m feelahead.benchmarks.viewing.timed_robot"
_FLAG = "--log="


def main() -> None:
    """Run the robot side's own command with a timed core."""
    run_command(PROGRAM, _command)


def _command(arguments: Sequence[str]) -> int:
    logs = [argument for argument in arguments if argument.startswith(_FLAG)]
    if len(logs) != 1:
        raise ConfigurationError(f"{_FLAG.rstrip('=')}: missing; valid: {_FLAG}FILE.npy, once")
    ticks: list[tuple[float, float, float]] = []
    robot_side.main.assemble = _timed(ticks)  # type: ignore[assignment,attr-defined]
    robot_side.main.Looking = _only_when_asked  # type: ignore[assignment,attr-defined]
    try:
        return robot_side.main.command([argument for argument in arguments if argument not in logs])
    finally:
        np.save(Path(logs[0].removeprefix(_FLAG)), np.array(ticks).reshape(-1, 3))


def _only_when_asked(*arguments: Any, **others: Any) -> Looking:
    """As Looking, which makes for a recording what nobody looks at."""
    return Looking(*arguments, **others | {"always": ()})


def _timed(ticks: list[tuple[float, float, float]]) -> object:
    """As `assemble`; each tick adds its `now`, its processor time and its thread's processor time until then."""

    def build(*arguments: object, **others: object) -> Assembled:
        assembled = assemble(*arguments, **others)  # type: ignore[arg-type]
        core = assembled.core
        noted, plain = core.tick, RobotSide.tick.__get__(core)

        def timed(now_s: float) -> list[Outgoing]:
            tick = noted if core.session.watchers.looked_at(now_s) else plain
            began_s = time.thread_time()
            outgoing = tick(now_s)
            ended_s = time.thread_time()
            ticks.append((now_s, ended_s - began_s, ended_s))
            return outgoing

        core.tick = timed  # type: ignore[method-assign]
        return assembled

    return build


if __name__ == "__main__":
    main()
