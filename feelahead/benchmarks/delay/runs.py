"""Many seeded runs of one link: how wrong the offset and the one-way delays were, and whether the bound held."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.delay.peers import PEERS
from feelahead.benchmarks.delay.traffic import Scenario, Traffic

GOAL_S = 0.5e-3
_LAST_S = 0.5
"""One-way delays are judged over the end of a run."""


@dataclass
class Outcome:
    """What the runs of one scenario gave; a list's entries are one number for each side of each run."""

    scenario: Scenario
    runs: int
    offset_errors_s: list[float] = field(default_factory=list)
    """At the end."""
    one_way_errors_s: list[float] = field(default_factory=list)
    """Root mean square over the last half second's arrivals."""
    within_after_s: list[float] = field(default_factory=list)
    """From when on the offset stayed within `GOAL_S`; infinite where it was not at the end."""
    widest_bounds_s: list[float] = field(default_factory=list)
    """The bound at the end."""
    peer_errors_s: dict[str, list[float]] = field(default_factory=dict)
    """The same moment's errors of the other estimators, at the robot's end."""
    estimators: Counter[str] = field(default_factory=Counter)
    judged: int = 0
    """Arrivals at which the bound was compared with the truth."""
    violations: int = 0


@dataclass
class _SideRun:
    """One side of one run."""

    offset_error_s: float = np.nan
    bound_s: float = np.nan
    outside_s: float = 0.0
    squares_s2: float = 0.0
    squared: int = 0


def measure(scenario: Scenario, runs: int, first_seed: int, duration_s: float, advance: Callable[[], None]) -> Outcome:
    """Let `runs` runs of `duration_s` of traffic happen; `advance` is called after each."""
    outcome = Outcome(scenario, runs, peer_errors_s={name: [] for name in PEERS})
    for seed in range(first_seed, first_seed + runs):
        _run(outcome, Traffic(scenario, seed, duration_s), duration_s)
        advance()
    return outcome


def _run(outcome: Outcome, traffic: Traffic, duration_s: float) -> None:
    sides = {"robot": _SideRun(), "operator": _SideRun()}
    for estimate in traffic:
        side = sides[estimate.side]
        if estimate.offset_error_s is None or estimate.bound_s is None:
            side.outside_s = estimate.at_s
            continue
        side.offset_error_s, side.bound_s = estimate.offset_error_s, estimate.bound_s
        size_s = abs(estimate.offset_error_s)
        outcome.judged += 1
        outcome.violations += size_s > estimate.bound_s
        if size_s > GOAL_S:
            side.outside_s = estimate.at_s
        if estimate.one_way_error_s is not None and estimate.at_s > duration_s - _LAST_S:
            side.squares_s2 += estimate.one_way_error_s**2
            side.squared += 1
    for name, end in (("robot", traffic.robot), ("operator", traffic.operator)):
        side = sides[name]
        outcome.offset_errors_s.append(side.offset_error_s)
        outcome.one_way_errors_s.append((side.squares_s2 / side.squared) ** 0.5 if side.squared else np.nan)
        outcome.within_after_s.append(side.outside_s if abs(side.offset_error_s) <= GOAL_S else np.inf)
        outcome.widest_bounds_s.append(side.bound_s)
        outcome.estimators[end.clock_offset.estimator or "none"] += 1
    _compare(outcome, traffic)


def _compare(outcome: Outcome, traffic: Traffic) -> None:
    """The others' errors, with the same asymmetry told to them."""
    stamps = traffic.robot_exchanges.stamps()
    newest_s = float(stamps.local_received_s[-1])
    true_s = traffic.clock.reads(newest_s) - newest_s
    for name, estimate in PEERS.items():
        outcome.peer_errors_s[name].append(estimate(stamps) + outcome.scenario.asymmetry_s / 2.0 - true_s)


def rms(values: FloatArray | list[float]) -> float:
    """Root mean square; NaN where a value is missing, because it must not pass for a good one."""
    return float(np.sqrt(np.mean(np.square(values))))


def quantile_of_sizes(values: FloatArray | list[float], probability: float) -> float:
    """The quantile of absolute values."""
    return float(np.quantile(np.abs(values), probability, method="inverted_cdf"))
