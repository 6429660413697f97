"""How do realistic links change what a finger of constant force hits, and do the emulations of a link agree?

feelahead try latency --links lan wifi lte --seeds 5 --csv latency.csv --picture latency.png
"""

import atexit
import functools
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import combinations, product
from pathlib import Path
from statistics import fmean, median
from typing import Annotated, Final, Literal

import tyro
from msgspec import Meta
from rich.table import Table as Shown

from common.command.command_line import parse_settings
from common.emulation.clauses import LinkModel
from common.emulation.named_links import NAMED_LINKS
from common.errors import FeelaheadError
from common.status.codes import LinkState
from feelahead.both_sides.episode import Episode
from feelahead.both_sides.real_time import LINK_S, run_for, started
from feelahead.both_sides.summary import merge_summaries
from feelahead.both_sides.trial import Trial, figures_of
from feelahead.containers.medium import ContainerMedium
from feelahead.lab.approaches.links import require_young_loop
from feelahead.lab.intervals import student_interval, welch_interval
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from feelahead.printing.pictures import figure
from operator_side.people.arming_hands import constant_force
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

Medium = Literal["virtual", "loopback", "containers"]
_DIRECTIONS: Final = ("to_robot", "to_operator")
_LOOK_S: Final = 0.01
_COMPARED: Final = (("mean_ms", "mean", "ms", 2.0), ("sd_ms", "sd", "ms", 1.0), ("lost_percent", "lost", "%", 0.1))
"""Figures in which the media should agree: column, name, unit and permitted difference of each."""
_COLOURS: Final[Mapping[str, str]] = {"virtual": "#0072b2", "loopback": "#d55e00", "containers": "#009e73"}
_WIDE: Final = 0.7
"""Share of a link's width in the figure that its media take up."""


@dataclass(frozen=True)
class LatencySettings(Sweep):
    """Pull R2 with a constant force towards a wall over realistic links, and show the effect of the delay.

    Each link is run with and without haptics, with the same seeds, in several media. These are virtual time, two
    processes that delay their own messages, and containers with the kernel's netem between them. A second table shows
    whether the media agree in delays and losses. Trials in real time run one by one.
    """

    seeds: Annotated[int, Meta(ge=1), tyro.conf.arg(metavar="N")] = 5
    """Number of seeds, each with one trial for each link, medium, and with or without haptics."""
    links: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME|SPEC...")] = tuple(NAMED_LINKS)
    """Links, each by its name or in netem's syntax for both directions."""
    haptics: tuple[Literal["on", "off"], ...] = ("on", "off")
    """Whether the triggers resist."""
    media: tuple[Literal["virtual", "loopback"], ...] = ("virtual", "loopback")
    """virtual: in this process, as fast as possible. loopback: two processes on 127.0.0.1, in real time."""
    compose: bool = False
    """Also run the trials in containers, with the kernel's netem between them."""
    model: LinkModel = "stream"
    """stream: messages stay in order and losses delay them, as by TCP. datagram: messages may be lost and reordered."""
    force: Annotated[float, Meta(ge=0.0, le=20.0), tyro.conf.arg(metavar="N")] = 3.0
    """Force on R2 in newtons: 2 is a light pull, 3.7 a normal one."""
    duration: Annotated[float, Meta(ge=2.0, le=1000.0), tyro.conf.arg(metavar="SECONDS")] = 8.0
    """Duration of each trial from when the link is up; the pull begins after 1.3 s and one or two round trips."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("links", "haptics", "media"):
            values = getattr(self, name)
            if len(set(values)) < len(values) or not (values or (name == "media" and self.compose)):
                raise ValueError(
                    f"--{name} {' '.join(values)}: a value is missing or given twice; valid: one or more, each once"
                )
        for link in self.links:
            require_young_loop(link, self.model)


@dataclass(frozen=True)
class Cell:
    """One link, with or without haptics, in one medium."""

    link: str
    haptics: str
    medium: Medium
    trial: Trial


def cells(settings: LatencySettings) -> Iterator[Cell]:
    """Yield each combination of link, haptics and medium."""
    containers: tuple[Medium, ...] = ("containers",) if settings.compose else ()
    links = settings.links[: 1 if settings.quick else None]
    for link, haptics, medium in product(links, settings.haptics, (*settings.media, *containers)):
        trial = Trial(link, haptics == "on", 0, settings.force, settings.duration, settings.model)
        yield Cell(link, haptics, medium, trial)


def run(cell: Cell, seed: int) -> Iterator[Row]:
    """Run one trial; yield its figures, with delays in milliseconds and losses in per cent."""
    yield _MEDIA[cell.medium](replace(cell.trial, seed=seed))


def in_virtual_time(trial: Trial) -> Row:
    """Run both cores and the emulated link in this process, as fast as possible."""
    link = trial.link_arguments()
    robot = parse_settings(RobotSettings, "feelahead-robot", [*trial.robot_arguments(), *link])
    operator = parse_settings(OperatorSettings, "feelahead-operator", [*trial.operator_arguments(), *link])
    both = Episode(robot=robot, operator=operator, person=constant_force(trial.force_n), sampled=False).loop
    while both.operator.status(both.clock.now()).link is not LinkState.UP:
        if both.clock.now() > LINK_S:
            raise FeelaheadError(f"no link within {LINK_S:g} s over --link {trial.link!r}")
        both.run_until(both.clock.now() + _LOOK_S)
    both.run_until(both.clock.now() + trial.duration_s)
    return figures_of(both.summary())


def on_loopback(trial: Trial) -> Row:
    """Run both sides as processes on 127.0.0.1, in real time; each emulates the link for its own messages."""
    link = trial.link_arguments()
    with started([*trial.robot_arguments(), *link], [*trial.operator_arguments(), *link]) as both:
        run_for(both.robot, both.operator, trial.duration_s)
        return figures_of(merge_summaries(*both.summaries(), []))


@functools.cache
def _containers() -> ContainerMedium:
    """Return the medium of containers; it is made once, and removed when this process ends."""
    stack = ExitStack()
    atexit.register(stack.close)
    return ContainerMedium(stack, os.getpid())


_MEDIA: Final[Mapping[Medium, Callable[[Trial], Row]]] = {
    "virtual": in_virtual_time,
    "loopback": on_loopback,
    "containers": lambda trial: _containers().run(trial),
}


def show(_: LatencySettings, table: Table) -> Iterator[Shown]:
    """Yield a table of the figures, and a table of whether the media agree."""
    headings = (
        *("link", "haptics", "medium", "trials", "to robot, ms", "sd", "p50", "p99", "lost, %"),
        *("to operator, ms", "sd", "p50", "p99", "lost, %"),
        *("contacts", "mm/s, median (most)", "nearest, mm", "stiffness", "tick p99, us", "stops"),
    )
    lines = []
    for kind, group in table.groups("link", "haptics", "medium"):
        speeds = group.values("contact_speed_mm_s")
        line = [*kind, str(len(group)), *(cell for direction in _DIRECTIONS for cell in _delays(group, direction))]
        line += [f"{len(speeds)}/{len(group)}", f"{median(speeds):.0f} ({max(speeds):.0f})" if speeds else ""]
        rest = (("min_distance_mm", 1), ("stiffness_max", 2), ("tick_p99_us", 0))
        lines.append(
            [*line, *(_mean(group.values(name), digits) for name, digits in rest), str(sum(group.values("stops")))]
        )
    yield shown("latency: a constant finger towards a wall", headings, lines)
    if len({row["medium"] for row in table}) > 1:
        yield agreement(table)


def _delays(group: Table, direction: str) -> Iterator[str]:
    means = group.values(f"{direction}_mean_ms")
    interval = student_interval(means)
    yield _mean(means, 2) + ("" if interval is None else f" ± {(interval[1] - interval[0]) / 2.0:.2f}")
    for name, digits in (("sd_ms", 2), ("p50_ms", 1), ("p99_ms", 1), ("lost_percent", 3)):
        yield _mean(group.values(f"{direction}_{name}"), digits)


def _mean(numbers: list[float], digits: int) -> str:
    return f"{fmean(numbers):.{digits}f}" if numbers else "-"


def agreement(table: Table) -> Shown:
    """Return a table that compares each pair of media: Welch's interval of the difference against the permitted one."""
    margins = ", ".join(f"{name} within ±{margin:g} {unit}" for _, name, unit, margin in _COMPARED)
    title = f"do the media agree? {margins}: the whole 95 % interval (Welch, over seeds) has to lie within"
    lines = []
    for (link,), group in table.groups("link"):
        for media in combinations(dict.fromkeys(row["medium"] for row in group), 2):
            for direction in _DIRECTIONS:
                samples = [
                    [by_seed(group.where(medium=medium), f"{direction}_{name}") for medium in media]
                    for name, *_ in _COMPARED
                ]
                verdicts = (
                    verdict(one, other, margin, unit)
                    for (one, other), (_, _, unit, margin) in zip(samples, _COMPARED, strict=True)
                )
                lines.append(
                    [link, " - ".join(media), direction, ", ".join(str(len(of)) for of in samples[0]), *verdicts]
                )
    return shown(title, ("link", "media", "direction", "seeds", *(name for _, name, _, _ in _COMPARED)), lines)


def by_seed(group: Table, name: str) -> list[float]:
    """Return each seed's mean over trials with and without haptics, as an emulated link draws the same in both."""
    found = (trials.values(name) for _, trials in group.groups("seed"))
    return [fmean(values) for values in found if values]


def verdict(first: list[float], second: list[float], margin: float, unit: str) -> str:
    """Say in words whether two media are equivalent within `margin`, differ by more, or have too few trials to tell."""
    if not first or not second:
        return "-"
    interval = welch_interval(first, second)
    if interval is None:
        return "not enough trials to tell"
    low, high = interval
    if -margin <= low and high <= margin:
        said = "equivalent"
    else:
        apart = f"differs by {fmean(second) - fmean(first):+.2f}"
        said = apart if low > margin or high < -margin else "not enough trials to tell"
    return f"{said} [{low:+.2f}, {high:+.2f}] {unit}"


def draw(_: LatencySettings, table: Table, path: Path) -> None:
    """Draw the delays in each direction (a dot for each seed, mean and 95 % interval), and contact speeds."""
    links, media = (list(dict.fromkeys(row[name] for row in table)) for name in ("link", "medium"))
    with figure(path, 1, 3, figsize=(13.0, 4.2)) as (_, panels):
        for (link, medium), group in table.groups("link", "medium"):
            place = links.index(link) + _WIDE * ((media.index(medium) + 0.5) / len(media) - 0.5)
            options = {"color": _COLOURS[medium], "label": medium if link == links[0] else ""}
            for panel, direction in zip(panels, _DIRECTIONS, strict=False):
                means = by_seed(group, f"{direction}_mean_ms")
                if not means:
                    continue
                low, high = student_interval(means) or (means[0], means[0])
                panel.plot([place] * len(means), means, ".", color=_COLOURS[medium], alpha=0.35)
                panel.errorbar(place, fmean(means), (high - low) / 2.0, fmt="o", capsize=4, markersize=4, **options)
                panel.set(yscale="log", ylabel="ms", title=f"mean delay {direction.replace('_', ' ')}")
            for row in group:
                # Such a run ended by the robot side's stop, not by what was felt.
                mark, filled = "x" if row["stops"] else "o", row["haptics"] == "on"
                face = _COLOURS[medium] if filled else "none"
                panels[2].plot(
                    place, row["contact_speed_mm_s"] or 0.0, mark, color=_COLOURS[medium], markerfacecolor=face
                )
        panels[2].set(ylabel="mm/s", title="first contact (none: 0; x: robot side stopped; hollow: no haptics)")
        panels[2].set_ylim(-5.0, 1.1 * max(panels[2].get_ylim()[1], 10.0))
        panels[0].legend()
        for panel in panels:
            panel.set_xticks(range(len(links)), links, rotation=20, ha="right")


QUESTION = Question("try latency", LatencySettings, cells, run, show, draw, timed=True)
