"""`feelahead bench delay`: clock offsets and one-way delays against the truth."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console
from rich.progress import Progress

from common.clock import MonotonicClock
from common.command.command_line import parse_settings
from common.files.output_file import output_file, require_output_file
from feelahead.benchmarks.delay.runs import GOAL_S, Outcome, measure, quantile_of_sizes, rms
from feelahead.benchmarks.delay.traffic import Scenario, scenarios
from feelahead.benchmarks.report import Goal, Table, show, show_goals

PROGRAM = "feelahead bench delay"
_WIDE = 150
_OTHERS_SHARE = 20
COLUMNS = ("link", "skew_ppm", "runs", "estimator", "quantity", "value", "unit")
"""Of the CSV."""


@dataclass(frozen=True)
class DelayEstimatesSettings:
    """How well each side knows the other's clock and the delays, against the truth, in virtual time.

    Two ends of a link exchange real messages, 1000 a second from the robot and 250 from the operator, between clocks
    that are up to a day apart and drift by 20 or 100 ppm. The offset and the one-way delays after the seconds given
    are compared with the truth, beside what others would have made of the same stamps; whether the bound on the
    offset held is looked at on every arrival. The first link, exponential queues above 50 ms both ways, takes all
    the runs; the other rows a twentieth each.

    A thousand runs take about four minutes on a core of their own.

    Try: feelahead bench delay --runs 50
    """

    runs: Annotated[int, tyro.conf.arg(metavar="N")] = 1000
    """Seeded runs of the first link."""
    seconds: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 5.0
    """Of traffic in each run."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Of the first run; the others count up from it."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write every figure there: link, skew_ppm, runs, estimator, quantity, value, unit."""

    def __post_init__(self) -> None:
        if not 1 <= self.runs <= 10**6:
            raise ValueError(f"--runs {self.runs}: valid: 1 to 1000000")
        if not 1.0 <= self.seconds <= 3600.0:
            raise ValueError(f"--seconds {self.seconds}: valid: 1 to 3600")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or more")
        require_output_file("--csv", self.csv)


def bench_delay(arguments: Sequence[str]) -> int:
    """Run the benchmark; exit code 0 whether or not the goals are met."""
    settings = parse_settings(DelayEstimatesSettings, PROGRAM, arguments)
    console = Console() if Console().is_terminal else Console(width=_WIDE)
    clock = MonotonicClock()
    start_s = clock.now()
    plan = _plan(settings.runs)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("runs", total=sum(runs for _, runs in plan))
        outcomes = [
            measure(scenario, runs, settings.seed, settings.seconds, lambda: progress.advance(task))
            for scenario, runs in plan
        ]
    for table in (_ours(outcomes), _compared(outcomes)):
        show(console, table)
    show_goals(console, goals(outcomes, settings.seconds))
    console.print(f"took {clock.now() - start_s:.0f} s", highlight=False)
    if settings.csv is not None:
        with output_file("--csv", settings.csv) as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            writer.writerows(row for outcome in outcomes for row in _rows(outcome))
    return 0


def goals(outcomes: Sequence[Outcome], seconds: float) -> list[Goal]:
    """What was promised for the first link, and for the bound on every link."""
    first = outcomes[0]
    told = f"{first.runs} runs of {seconds:g} s, both sides, the worst"
    judged = sum(outcome.judged for outcome in outcomes)
    return [
        Goal("offset error in ms", 1e3 * quantile_of_sizes(first.offset_errors_s, 1.0), 1e3 * GOAL_S, detail=told),
        Goal(
            "one-way delay error in ms",
            1e3 * quantile_of_sizes(first.one_way_errors_s, 1.0),
            1e3 * GOAL_S,
            detail=f"{told}, rms over its last half second",
        ),
        Goal(
            "violations of the bound",
            sum(outcome.violations for outcome in outcomes),
            0,
            detail=f"{judged} arrivals in {sum(outcome.runs for outcome in outcomes)} runs of every link",
        ),
    ]


def _plan(runs: int) -> list[tuple[Scenario, int]]:
    others = -(-runs // _OTHERS_SHARE)
    return [(scenario, runs if position == 0 else others) for position, scenario in enumerate(scenarios())]


def _ours(outcomes: Sequence[Outcome]) -> Table:
    rows = []
    for outcome in outcomes:
        rows.append(
            (
                outcome.scenario.name,
                f"{1e6 * outcome.scenario.skew:.0f}",
                str(outcome.runs),
                f"{1e3 * rms(outcome.offset_errors_s):.3f}",
                f"{1e3 * quantile_of_sizes(outcome.offset_errors_s, 0.99):.3f}",
                f"{1e3 * quantile_of_sizes(outcome.offset_errors_s, 1.0):.3f}",
                f"{1e3 * rms(outcome.one_way_errors_s):.3f}",
                f"{float(np.median(outcome.within_after_s)):.2f}",
                f"{quantile_of_sizes(outcome.within_after_s, 0.99):.2f}",
                f"{1e3 * float(np.mean(outcome.widest_bounds_s)):.1f}",
                str(outcome.violations),
                ", ".join(f"{name} {count}" for name, count in outcome.estimators.most_common()),
            )
        )
    columns = (
        "link",
        "skew ppm",
        "runs",
        "offset rms",
        "p99",
        "max",
        "one-way rms",
        "good after",
        "p99",
        "bound",
        "violated",
        "estimator",
    )
    note = (
        "Errors in ms. Good: within 0.5 ms from then on, in s. "
        "What one way's floor has more than the other's and nobody told costs half of itself, whatever the estimator; "
        "the bound covers it."
    )
    return Table("Errors of both sides' estimates at the end of a run", columns, rows, note)


def _compared(outcomes: Sequence[Outcome]) -> Table:
    names = list(outcomes[0].peer_errors_s)
    rows = []
    for outcome in outcomes:
        ours_s = outcome.offset_errors_s[::2]
        cells = [f"{1e3 * rms(errors_s):.3f}" for errors_s in (ours_s, *outcome.peer_errors_s.values())]
        rows.append((outcome.scenario.name, f"{1e6 * outcome.scenario.skew:.0f}", *cells))
    note = "The robot's end; every estimator has the same stamps, and the asymmetry where it is told."
    return Table("Offset error, rms in ms, beside other estimators", ("link", "skew ppm", "ours", *names), rows, note)


def _rows(outcome: Outcome) -> Iterator[tuple[str, str, int, str, str, float, str]]:
    head = (outcome.scenario.name, f"{1e6 * outcome.scenario.skew:g}", outcome.runs)
    for side, place in (("robot", 0), ("operator", 1)):
        errors_s = outcome.offset_errors_s[place::2]
        one_way_s = outcome.one_way_errors_s[place::2]
        after_s = outcome.within_after_s[place::2]
        ours = f"ours, {side}"
        yield (*head, ours, "offset error rms", 1e3 * rms(errors_s), "ms")
        yield (*head, ours, "offset error p99", 1e3 * quantile_of_sizes(errors_s, 0.99), "ms")
        yield (*head, ours, "offset error max", 1e3 * quantile_of_sizes(errors_s, 1.0), "ms")
        yield (*head, ours, "one-way delay error rms", 1e3 * rms(one_way_s), "ms")
        yield (*head, ours, "one-way delay error max of rms", 1e3 * quantile_of_sizes(one_way_s, 1.0), "ms")
        yield (*head, ours, "within 0.5 ms after p50", float(np.median(after_s)), "s")
        yield (*head, ours, "within 0.5 ms after p99", quantile_of_sizes(after_s, 0.99), "s")
        yield (*head, ours, "bound mean", 1e3 * float(np.mean(outcome.widest_bounds_s[place::2])), "ms")
    yield (*head, "ours, both", "bound violations", outcome.violations, "arrivals")
    yield (*head, "ours, both", "bound judged", outcome.judged, "arrivals")
    for name, errors_s in outcome.peer_errors_s.items():
        yield (*head, name, "offset error rms", 1e3 * rms(errors_s), "ms")
        yield (*head, name, "offset error max", 1e3 * quantile_of_sizes(errors_s, 1.0), "ms")
