"""What the trials say: a row for each link, haptics and medium, and whether the media agree."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from statistics import fmean, median
from typing import Any, Final, get_args

from rich.box import MARKDOWN
from rich.table import Table

from common.emulation.spec import Direction
from feelahead.both_sides.trial import TrialFigures, WayFigures
from feelahead.experiments.latency.equivalence import Difference, difference, mean_half_width
from feelahead.experiments.latency.matrix import Row

_COMPARED: Final[tuple[tuple[str, str, float, Callable[[WayFigures], float | None]], ...]] = (
    ("mean", "ms", 2.0, lambda way: way.mean_ms),
    ("sd", "ms", 1.0, lambda way: way.sd_ms),
    ("lost", "%-points", 0.1, lambda way: None if way.loss_share is None else 100.0 * way.loss_share),
)
"""What the media are to agree on, in which unit, within which margin."""


@dataclass(frozen=True)
class Agreement:
    """Of two media, on one figure of one direction of one link."""

    link: str
    media: tuple[str, str]
    direction: Direction
    figure: str
    unit: str
    seeds: tuple[int, int]
    """How many numbers there are from either"""
    difference: Difference

    def in_words(self) -> str:
        """The verdict, with the interval."""
        one = self.difference
        said = f"differs by {one.mean:+.2f}" if one.verdict == "differs" else one.verdict
        interval = "" if min(self.seeds) < 2 else f" [{one.low:+.2f}, {one.high:+.2f}] {self.unit}"
        return said + interval


def values(rows: Sequence[Row], figure: Callable[[TrialFigures], float | None]) -> list[float]:
    """One for each trial that has it."""
    return [value for row in rows if (value := figure(row.figures)) is not None]


def way(direction: Direction, figure: Callable[[WayFigures], float | None]) -> Callable[[TrialFigures], float | None]:
    """`figure` of one direction."""
    return lambda figures: figure(getattr(figures, direction))


def grouped(rows: Sequence[Row]) -> dict[tuple[str, bool, str], list[Row]]:
    """By link, haptics and medium, in the order of the trials."""
    groups: dict[tuple[str, bool, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.trial.link, row.trial.haptics, row.medium), []).append(row)
    return groups


def figures_table(rows: Sequence[Row]) -> Table:
    """A row for each link, haptics and medium; means with 95 % intervals over trials."""
    shown = Table(title="latency: a constant finger towards a wall", box=MARKDOWN)
    for heading in (
        *("link", "haptics", "medium", "trials", "to robot, ms", "sd", "p50", "p99", "lost, %"),
        *("to operator, ms", "sd", "p50", "p99", "lost, %"),
        *("contacts", "mm/s, median (most)", "nearest, mm", "stiffness", "tick p99, us", "stops"),
    ):
        shown.add_column(heading, justify="left" if heading in ("link", "haptics", "medium") else "right")
    for (link, haptics, medium), group in grouped(rows).items():
        speeds = values(group, lambda one: one.contact_speed_mm_s)
        shown.add_row(
            link,
            "on" if haptics else "off",
            medium,
            str(len(group)),
            *(cell for direction in get_args(Direction) for cell in _way_cells(group, direction)),
            f"{len(speeds)}/{len(group)}",
            f"{median(speeds):.0f} ({max(speeds):.0f})" if speeds else "",
            _mean(values(group, lambda one: one.min_distance_mm), 1),
            _mean(values(group, lambda one: one.stiffness_max), 2),
            _mean(values(group, lambda one: one.tick_p99_us), 0),
            str(sum(row.figures.stops for row in group)),
        )
    return shown


def _way_cells(group: Sequence[Row], direction: Direction) -> Iterator[str]:
    means = values(group, way(direction, lambda one: one.mean_ms))
    half = mean_half_width(means)
    yield _mean(means, 2) + ("" if half is None else f" ± {half:.2f}")
    yield _mean(values(group, way(direction, lambda one: one.sd_ms)), 2)
    yield _mean(values(group, way(direction, lambda one: one.p50_ms)), 1)
    yield _mean(values(group, way(direction, lambda one: one.p99_ms)), 1)
    yield _mean([100.0 * share for share in values(group, way(direction, lambda one: one.loss_share))], 3)


def _mean(numbers: Sequence[float], digits: int) -> str:
    return f"{fmean(numbers):.{digits}f}" if numbers else "-"


def agreements(rows: Sequence[Row]) -> list[Agreement]:
    """For each link and pair of media."""
    found = []
    for link in dict.fromkeys(row.trial.link for row in rows):
        mine = [row for row in rows if row.trial.link == link]
        for first, second in combinations(dict.fromkeys(row.medium for row in mine), 2):
            for direction in get_args(Direction):
                for name, unit, margin, figure in _COMPARED:
                    parts = ([row for row in mine if row.medium == medium] for medium in (first, second))
                    one, other = (by_seed(part, way(direction, figure)) for part in parts)
                    if one and other:
                        apart = difference(one, other, margin)
                        seeds = len(one), len(other)
                        found.append(Agreement(link, (first, second), direction, name, unit, seeds, apart))
    return found


def by_seed(rows: Sequence[Row], figure: Callable[[TrialFigures], float | None]) -> list[float]:
    """One number for each seed, the mean with and without haptics: an emulated link draws the same in both."""
    seeds = dict.fromkeys(row.trial.seed for row in rows)
    found = (values([row for row in rows if row.trial.seed == seed], figure) for seed in seeds)
    return [fmean(those) for those in found if those]


def agreement_table(those: Sequence[Agreement]) -> Table:
    """A row for each link, pair of media and direction."""
    margins = ", ".join(f"{name} within ±{margin:g} {unit}" for name, unit, margin, _ in _COMPARED)
    title = f"do the media agree? {margins}: the whole 95 % interval (Welch, over seeds) has to lie within"
    shown = Table(title=title, box=MARKDOWN)
    for heading in ("link", "media", "direction", "seeds", *(name for name, *_ in _COMPARED)):
        shown.add_column(heading)
    cells: dict[tuple[str, tuple[str, str], Direction], dict[str, Agreement]] = {}
    for one in those:
        cells.setdefault((one.link, one.media, one.direction), {})[one.figure] = one
    for (link, pair, direction), by_figure in cells.items():
        seeds = next(iter(by_figure.values())).seeds
        said = (by_figure[name].in_words() if name in by_figure else "-" for name, *_ in _COMPARED)
        shown.add_row(link, " - ".join(pair), direction, f"{seeds[0]}, {seeds[1]}", *said)
    return shown


def as_json(rows: Sequence[Row], failed: Sequence[str]) -> dict[str, Any]:
    """Every trial, what failed, and how far the media agree."""
    return {
        "trials": [{"medium": row.medium} | asdict(row.trial) | asdict(row.figures) for row in rows],
        "failed": list(failed),
        "agreements": [
            asdict(one)
            | {
                "difference": {
                    "mean": one.difference.mean,
                    "margin": one.difference.margin,
                    # Infinite below two trials, which JSON does not know.
                    "interval": None if min(one.seeds) < 2 else [one.difference.low, one.difference.high],
                },
                "verdict": one.difference.verdict,
            }
            for one in agreements(rows)
        ],
    }
