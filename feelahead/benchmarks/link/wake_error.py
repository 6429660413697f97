"""How late a 1 kHz loop wakes, by how it waits and by what the system was asked for.

    feelahead bench wake --seconds 5

Each row is a loop of its own in a fresh process, with the sockets that the robot side waits on and no message
arriving. The rows take turns, so that what else the machine does falls on all of them.
"""

import multiprocessing
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.clock import MonotonicClock
from common.command.command_line import parse_settings
from common.realtime.pacing import SPIN_S, Pacer, wait_for_turn
from common.realtime.priority import make_realtime, raise_priority
from common.sockets.robot import RobotSockets

_PROGRAM = "feelahead bench wake"
_PERIOD_S = 1e-3
_WAYS = {
    "sleep": (0.0, False, False),
    "sleep, raised priority": (0.0, True, False),
    "sleep + spin": (SPIN_S, False, False),
    "sleep + spin, raised priority": (SPIN_S, True, False),
    "sleep + spin, --realtime": (SPIN_S, True, True),
}
"""Each with the length of its spin, whether the priority is raised, and whether it is real-time."""


@dataclass(frozen=True)
class WakeSettings:
    """How long each way of waiting is watched."""

    seconds: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 5.0
    """For each way, in each round."""
    rounds: Annotated[int, tyro.conf.arg(metavar="N")] = 3
    """How often each way has its turn."""

    def __post_init__(self) -> None:
        if not 0.1 <= self.seconds <= 600.0:
            raise ValueError(f"--seconds {self.seconds}: valid: 0.1 to 600")
        if not 1 <= self.rounds <= 100:
            raise ValueError(f"--rounds {self.rounds}: valid: 1 to 100")


def watch(way: str, seconds: float) -> tuple[list[float], int, float]:
    """Wake errors in seconds, overruns, and the share of a core, of one loop in a process of its own."""
    spin_s, raised, realtime = _WAYS[way]
    clock = MonotonicClock()
    errors_s = []
    with RobotSockets("tcp://127.0.0.1:0") as sockets:
        if raised:
            raise_priority()
        if realtime and make_realtime():
            return [], 0, 0.0
        began_s, began_cpu_s = clock.now(), time.process_time()
        pacer = Pacer(_PERIOD_S, began_s)
        while (now_s := clock.now()) < began_s + seconds:
            if pacer.due(now_s):
                errors_s.append(now_s - pacer.deadline_s)
                pacer.begin(now_s)
            sockets.receive()
            wait_for_turn(pacer, clock, sockets.wait, None, spin_s)
        return errors_s, pacer.overruns, (time.process_time() - began_cpu_s) / (clock.now() - began_s)


def bench_wake(arguments: Sequence[str]) -> int:
    """Measure and print the table."""
    settings = parse_settings(WakeSettings, _PROGRAM, arguments)
    found: dict[str, list[tuple[list[float], int, float]]] = {way: [] for way in _WAYS}
    context = multiprocessing.get_context("spawn")
    with Progress(transient=True) as progress:
        bar = progress.add_task("loops", total=settings.rounds * len(_WAYS))
        for _ in range(settings.rounds):
            for way, outcomes in found.items():
                with context.Pool(1) as pool:
                    outcomes.append(pool.apply(watch, (way, settings.seconds)))
                progress.advance(bar)
    shown = Table(title=f"wake error at 1 kHz, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    for heading in ("way", "p50, us", "p99, us", "p99.9, us", "overruns", "of a core"):
        shown.add_column(heading, justify="left" if heading == "way" else "right")
    for way, outcomes in found.items():
        errors_us = [1e6 * error_s for errors_s, _, _ in outcomes for error_s in errors_s]
        if not errors_us:
            shown.add_row(way, "not permitted here")
            continue
        quantiles = (f"{value:.1f}" for value in np.quantile(errors_us, (0.5, 0.99, 0.999)))
        share = np.mean([share for _, _, share in outcomes])
        shown.add_row(way, *quantiles, str(sum(overruns for _, overruns, _ in outcomes)), f"{share:.0%}")
    Console(width=100 if not sys.stdout.isatty() else None).print(shown)
    return 0
