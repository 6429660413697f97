"""`feelahead bench viewing`: what it costs the robot side that two look and all is recorded, in turns."""

import os
import secrets
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.arrays import FloatArray
from common.command.command_line import parse_settings
from common.errors import FeelaheadError
from common.protocol.view_messages import SceneState, VideoFrame
from feelahead.benchmarks.viewing.companion_process import companion_of, processor_s
from feelahead.benchmarks.viewing.viewer import Seen, Viewer, look
from feelahead.both_sides.processes import SideProcess

_PROGRAM: Final = "feelahead bench viewing"
_SLOW: Final = "video: rate 2mbit"
_SETTLING_S: Final = 0.2
"""At the beginning of each turn: the last pictures of the turn before are still under way."""
_LEAST_TICKS: Final = 10
_WARMING_S: Final = 3.0
_STARTING_S: Final = 600.0
_ONE_SIDED_95: Final = 1.645
_VIEWERS: Final = 2


@dataclass(frozen=True)
class ViewingSettings:
    """A real robot side at 1 kHz: two look at both views and the scene, and all is recorded; then neither; in turns.

    Each tick's processor time from reading the arm to its messages, the processor time of everything that its thread
    does, and the turns that were not taken; pictures in a second; stiffness ages, also while video has 2 Mbit/s.
    """

    turns: int = 60
    """Of looking, and as many of not looking."""
    seconds: float = 1.0
    """Each."""
    quick: bool = False
    """20 turns of each."""
    record: bool = True
    """While they look."""

    def __post_init__(self) -> None:
        if not 2 <= self.turns <= 1000:
            raise ValueError(f"--turns {self.turns}: valid: 2 to 1000")
        if not 0.5 <= self.seconds <= 60.0:
            raise ValueError(f"--seconds {self.seconds}: valid: 0.5 to 60")


@dataclass
class Turns:
    """What was measured over one link."""

    ticks: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    """(t, 3) `now`, processor time of the tick, and of the thread until its end"""
    looking: list[Seen] = field(default_factory=list)
    away: list[Seen] = field(default_factory=list)
    companion_share: float = 0.0
    """Of a processor, while somebody looks"""

    def each(self, turns: list[Seen], figure: str) -> FloatArray:
        """One number for each turn: `p50`, `p99` in us, `thread` as a share of a processor, or `missed` ticks."""
        found = []
        for turn in turns:
            within = self.ticks[(self.ticks[:, 0] >= turn.began_s + _SETTLING_S) & (self.ticks[:, 0] < turn.ended_s)]
            if len(within) < _LEAST_TICKS:
                raise FeelaheadError(
                    f"{len(within)} ticks in {turn.ended_s - turn.began_s:.1f} s: this machine is too busy to measure"
                )
            span_s = within[-1, 0] - within[0, 0]
            found.append(
                {
                    "p50": 1e6 * float(np.quantile(within[:, 1], 0.5)),
                    "p99": 1e6 * float(np.quantile(within[:, 1], 0.99)),
                    "thread": float(within[-1, 2] - within[0, 2]) / span_s,
                    "missed": max(0.0, 1e3 * span_s + 1.0 - len(within)),
                }[figure]
            )
        return np.array(found)


def bench_viewing(arguments: Sequence[str]) -> int:
    """Measure and print two tables."""
    settings = parse_settings(ViewingSettings, _PROGRAM, arguments)
    count = 20 if settings.quick else settings.turns
    console = Console(width=100 if not sys.stdout.isatty() else None)
    with Progress(transient=True, console=console) as progress:
        bar = progress.add_task("turns", total=4 * count)
        found = {link: _measure(link, count, settings, lambda: progress.advance(bar)) for link in ("", _SLOW)}
    console.print(_cost_table(found[""], "two look and all is recorded" if settings.record else "two look"))
    console.print(_age_table(found))
    return 0


def _measure(link: str, count: int, settings: ViewingSettings, advance: Callable[[], None]) -> Turns:
    found = Turns()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "ticks.npy"
        arguments = [f"--log={log}", "--bind=tcp://127.0.0.1:0", *([f"--link={link}"] if link else [])]
        arguments += [f"--record={folder}/run.mcap"] if settings.record else []
        with SideProcess("feelahead.benchmarks.tick.timed_robot", "robot", arguments) as robot:
            listening = robot.wait_for("listening", _STARTING_S)
            viewers = [Viewer(listening["control"], listening["view"], secrets.randbits(53)) for _ in range(_VIEWERS)]
            everything = {"overview": True, "first_person": True, "scene": True}
            look(viewers, _WARMING_S, **everything)
            looked_s = busy_s = 0.0
            for _ in range(count):
                found.away.append(look(viewers, settings.seconds))
                advance()
                companion = companion_of(robot.process_id)
                began_s = 0.0 if companion is None else processor_s(companion)
                found.looking.append(look(viewers, settings.seconds, **everything))
                if companion is not None:
                    busy_s += processor_s(companion) - began_s
                looked_s += settings.seconds
                advance()
            found.companion_share = busy_s / looked_s
            for viewer in viewers:
                viewer.close()
            robot.stop()
            robot.check()
        found.ticks = np.load(log)
    return found


def _cost_table(found: Turns, case: str) -> Table:
    shown = Table(
        title=f"the robot side at 1 kHz, both views and the scene; {len(found.looking)} turns of each,"
        f" {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}"
    )
    for heading in ("", "nobody looks", case, "paired difference", "its upper bound (95 %)"):
        shown.add_column(heading, justify="left" if not heading else "right")
    rows = (
        ("tick's processor time p50, us", "p50", 1.0, ".1f"),
        ("tick's processor time p99, us", "p99", 1.0, ".1f"),
        ("the thread, % of a processor", "thread", 100.0, ".1f"),
        ("turns of a second not taken", "missed", 1.0, ".2f"),
    )
    for name, figure, scale, digits in rows:
        away, looking = scale * found.each(found.away, figure), scale * found.each(found.looking, figure)
        more = looking - away
        bound = float(more.mean() + _ONE_SIDED_95 * more.std(ddof=1) / np.sqrt(more.size))
        relative = f" ({100.0 * bound / away.mean():+.1f} %)" if away.mean() > 0.0 else ""
        shown.add_row(
            name,
            *(format(float(value), digits) for value in (away.mean(), looking.mean(), more.mean())),
            format(bound, digits) + relative,
        )
    return shown


def _age_table(found: dict[str, Turns]) -> Table:
    shown = Table(title="what the viewer gets while it looks")
    for heading in ("", "no link emulated", _SLOW):
        shown.add_column(heading, justify="left" if not heading else "right")
    rows: dict[str, list[str]] = {}
    for turns in found.values():
        seconds = sum(turn.ended_s - turn.began_s for turn in turns.looking)
        for view in ("overview", "first_person"):
            ages_s = [
                arrived_s - message.captured_s
                for turn in turns.looking
                for arrived_s, message in turn.views
                if isinstance(message, VideoFrame) and message.view == view
            ]
            rows.setdefault(f"{view}: pictures a second; age p50, p99, ms", []).append(
                f"{len(ages_s) / seconds:.1f}; {_quantiles(ages_s)}"
            )
        states = sum(isinstance(message, SceneState) for turn in turns.looking for _, message in turn.views)
        rows.setdefault("scene: states a second", []).append(f"{states / seconds:.1f}")
        lengths = sum(sum(turn.lengths) for turn in turns.looking)
        rows.setdefault("all of it, Mbit/s", []).append(f"{8e-6 * lengths / seconds:.1f}")
        for name, some in (("looking", turns.looking), ("not looking", turns.away)):
            ages_s = [age_s for turn in some for age_s in turn.stiffness_ages_s]
            rows.setdefault(f"stiffness age p50, p99, ms, {name}", []).append(_quantiles(ages_s))
        rows.setdefault("companion, % of a processor", []).append(f"{100.0 * turns.companion_share:.0f}")
    for row, cells in rows.items():
        shown.add_row(row, *cells)
    return shown


def _quantiles(values_s: Sequence[float]) -> str:
    if not values_s:
        return "-"
    middle, late = 1e3 * np.quantile(values_s, (0.5, 0.99))
    return f"{middle:.2f}, {late:.2f}"
