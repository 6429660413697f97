"""What share of a processor do both sides take as real processes, and how late is what is felt?

feelahead bench turn --seeds 2 --other ../before/.venv/bin/python
"""

import contextlib
import itertools
import json
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
import tyro
from msgspec import Meta
from rich.console import RenderableType

from common.command.run_options import TickPeriod, tick_period_s
from common.errors import FeelaheadError
from common.files.input_file import require_input_file
from common.periods import TURN
from feelahead.both_sides.processes import StartedSide
from feelahead.both_sides.summary import read_summary
from feelahead.lab import timed_hands
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown

State = Literal["rest", "free", "near", "aside", "demo", "throttled"]
_RUNS: Final[dict[State, tuple[str | None, str]]] = {
    "rest": (None, "rest"),
    "free": ("empty", "straight"),
    "near": ("cluttered", "straight"),
    "aside": ("wall", "aside"),
    "demo": (None, "task"),
    "throttled": ("cluttered", "straight"),
}
"""Frozen scene of each state, None for the built-in one, and how the person drives in it (`timed_hands`)"""
_START_S: Final = 600.0
_ARMED_S: Final = 600.0
_END_S: Final = 120.0
"""Time in seconds after which a side that does not end is killed: the machine may be busy"""
_DOOR: Final = b"sockets.door.keeper"
_SETTLING_S: Final = 4.0
"""Time from the link, or from arming, to the measurement, in seconds: a machine that is too slow needs as long"""
_THROTTLE_S: Final = 0.05
_THROTTLED: Final = 0.2
"""Period of stopping and continuing the robot side, in seconds, and share of it for which it runs"""
_OWN: Final = "this"


@dataclass(frozen=True)
class TurnSweep(Sweep):
    """Run both sides as processes on this machine, with a simulated controller and no console, and measure them.

    rest: the demo's table, linked, not armed. free: the arm goes to and fro in an empty scene. near: the same amid
    objects. aside: with a stick, before a wall. demo: the demo's scripted person. throttled: as near, but the robot
    side is stopped for four fifths of the time. Shares are of one processor, with all threads of a process. The delay
    is from the robot side's tick to the bytes that the controller has got, of fields that are written when they arrive.
    Shares hold on a busy machine, too; delays do not.
    """

    states: tuple[State, ...] = ("rest", "free", "near", "aside")
    """States to measure."""
    seconds: Annotated[float, Meta(ge=1.0, le=600.0)] = 15.0
    """Duration of each measurement, in seconds; 4 with --quick."""
    tick_period: TickPeriod = TURN
    """Period of both sides' turns, 1ms to 20ms."""
    other: Annotated[Path | None, tyro.conf.arg(metavar="PYTHON")] = None
    """Measure another version of feelahead in turns with this one: the Python of its environment. It gets no period."""

    def __post_init__(self) -> None:
        super().__post_init__()
        tick_period_s(self.tick_period)
        if self.other is not None:
            require_input_file("--other", self.other, "the Python of another environment")


@dataclass(frozen=True)
class Case:
    """Cell: one run of both sides in one state."""

    state: State
    version: str
    """Python of the environment; `this` for this one"""
    period: str
    seconds: float


def cells(settings: TurnSweep) -> Iterator[Case]:
    """Yield the cells; for each state both versions after each other."""
    versions = [_OWN] if settings.other is None else [str(settings.other.absolute()), _OWN]
    for state, version in itertools.product(settings.states, versions):
        yield Case(state, version, settings.tick_period, 4.0 if settings.quick else settings.seconds)


class _Pair(NamedTuple):
    robot: StartedSide
    operator: StartedSide
    folder: Path


@contextmanager
def _started(case: Case, seed: int) -> Iterator[_Pair]:
    """Start both sides, and wait until they are linked; throttled: the robot side from when it listens."""
    own = case.version == _OWN
    python, (scene, drives) = sys.executable if own else case.version, _RUNS[case.state]
    with tempfile.TemporaryDirectory(prefix="feelahead-") as name, ExitStack() as stack:
        folder = Path(name)
        common = ["--status=json", f"--seed={seed}", *([f"--tick-period={case.period}"] if own else [])]
        flags = ["--bind=tcp://127.0.0.1:0", "--no-cameras", f"--summary={folder / 'robot.json'}"]
        flags += [] if scene is None else [f"--model={frozen_scene(scene)}", f"--site={SITE}"]
        ours = [python, "-P", "-m", "robot_side", *common, *flags]
        robot = stack.enter_context(StartedSide("robot", ours))
        heard = robot.wait_for("listening", _START_S)
        if case.state == "throttled":
            stack.enter_context(_throttled(robot.process_id))
        ends = [f"--connect={heard['control']}", f"--view-connect={heard['view']}", "--device=simulated"]
        hands = [str(timed_hands.__file__), f"--drives={drives}", f"--log={folder / 'delays.json'}"]
        theirs = [python, "-P", *hands, *common, *ends, f"--summary={folder / 'operator.json'}"]
        operator = stack.enter_context(StartedSide("operator", theirs))
        yield _Pair(robot, operator, folder)


@contextmanager
def _throttled(process: int) -> Iterator[None]:
    """Stop and continue the process all the time; at the end it goes on."""
    over = threading.Event()

    def throttle() -> None:
        with contextlib.suppress(ProcessLookupError):  # it has ended
            while not over.is_set():
                os.kill(process, signal.SIGSTOP)
                time.sleep((1.0 - _THROTTLED) * _THROTTLE_S)
                os.kill(process, signal.SIGCONT)
                time.sleep(_THROTTLED * _THROTTLE_S)

    thread = threading.Thread(target=throttle, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _wait_for_state(pair: _Pair, state: str) -> None:
    end_s = time.monotonic() + _ARMED_S
    while pair.operator.wait_for("status", _ARMED_S).get("state") != state:
        pair.robot.check()
        if time.monotonic() > end_s:
            raise FeelaheadError(f"the arm is not {state} within {_ARMED_S:g} s")


def _processor_s(process: int) -> float:
    """Return the processor time of all threads of a process, in seconds."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / float(os.sysconf("SC_CLK_TCK"))


def _door_of(process: int) -> int | None:
    """Return the process that owns a robot side's ports; None in versions without one."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text(encoding="utf-8").split()
    return next((int(each) for each in children if _DOOR in Path(f"/proc/{each}/cmdline").read_bytes()), None)


def run(cell: Case, seed: int) -> Iterator[Row]:
    """Run both sides once; yield a row with the figures of both."""
    with _started(cell, seed) as pair:
        sides = pair.robot, pair.operator
        _wait_for_state(pair, "disarmed" if cell.state == "rest" else "armed")
        time.sleep(_SETTLING_S)
        for side in sides:
            side.events()
        door = _door_of(pair.robot.process_id)
        processes = [*(side.process_id for side in sides), *([] if door is None else [door])]
        began_s, before = time.monotonic(), [_processor_s(process) for process in processes]
        time.sleep(cell.seconds)
        after, ended_s = [_processor_s(process) for process in processes], time.monotonic()
        statuses = [[one for one in side.events() if one["event"] == "status"] for side in sides]
        for side in sides:
            side.interrupt()
        for side in sides:
            side.stop(_END_S)
            side.check()
        robot, operator = (read_summary(pair.folder / f"{name}.json") for name in ("robot", "operator"))
        delays_s = json.loads((pair.folder / "delays.json").read_text(encoding="utf-8"))
    figures = {**_figures(robot, "robot", statuses[0]), **_figures(operator, "operator", statuses[1])}
    shares = [(later - earlier) / (ended_s - began_s) for earlier, later in zip(before, after, strict=True)]
    yield {
        "robot_share": shares[0],
        "operator_share": shares[1],
        "door_share": None if door is None else shares[2],
        "armed": float(np.mean([one.get("state") == "armed" for one in statuses[1]])) if statuses[1] else None,
        "stops": len(robot["stops"]),
        **figures,
        "tick_p99_of_period": 1e-3 * robot["tick_cpu_us"]["p99"] / figures["robot_period_ms"],
        "loop_age_ms": robot["loop_age_ms"]["p50"],
        "delay_p50_ms": 1e3 * float(np.quantile(delays_s, 0.5)) if delays_s else None,
        "delay_p99_ms": 1e3 * float(np.quantile(delays_s, 0.99)) if delays_s else None,
        "load": os.getloadavg()[0],
    }


def _figures(summary: dict[str, Any], side: str, statuses: list[dict[str, Any]]) -> Row:
    """Return the period at the end, the missed deadlines, and p99 of a turn's processor time as a share of the period.

    A version that does not say its period had 1 ms (robot side) and 4 ms (operator side), and no figure of whole turns.
    """
    pacing = summary["pacing"][side]
    period_ms, p99_us = pacing.get("period_ms"), pacing.get("turn_cpu_us", {}).get("p99")
    found = [one.get("overruns" if side == "robot" else "motion_overruns") for one in statuses]
    missed = [count for count in found if count is not None]
    return {
        f"{side}_period_ms": {"robot": 1.0, "operator": 4.0}[side] if period_ms is None else period_ms,
        f"{side}_missed": missed[-1] - missed[0] if missed else None,
        f"{side}_p99_of_period": None if p99_us is None or period_ms is None else 1e-3 * p99_us / period_ms,
    }


_TIMES: Final = {
    "robot_share": "robot, of a core",
    "door_share": "its door, of a core",
    "operator_share": "operator, of a core",
    "robot_period_ms": "period, ms",
    "robot_missed": "missed",
    "operator_missed": "operator missed",
    "robot_p99_of_period": "turn p99 / period",
    "operator_p99_of_period": "operator p99 / period",
    "tick_p99_of_period": "tick p99 / period",
}
_DELAYS: Final = {
    "delay_p50_ms": "felt after, ms",
    "delay_p99_ms": "p99",
    "loop_age_ms": "loop age, ms",
    "armed": "armed",
    "stops": "stops",
    "load": "load",
}


def show(_: TurnSweep, table: Table) -> Iterator[RenderableType]:
    """Yield a table of processor times and one of delays: medians over the seeds, by state and version."""
    for title, columns in (("processor time", _TIMES), ("delays", _DELAYS)):
        lines = []
        for (state, version), runs in table.groups("state", "version"):
            medians = [float(np.median(found)) if (found := runs.values(name)) else None for name in columns]
            lines.append((state, _OWN if version == _OWN else "other", *medians))
        headings = "state", "version", *columns.values()
        yield shown(f"{title} of both sides, without console, medians of all seeds", headings, lines)


QUESTION = Question("bench turn", TurnSweep, cells, run, show, timed=True)
