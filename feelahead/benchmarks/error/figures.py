"""Every figure of the benchmark as rows of a CSV."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from common.files.output_file import output_file
from feelahead.benchmarks.error.prediction import COMPENSATIONS, VARIANTS, Judged
from feelahead.benchmarks.error.propagation import METHODS, Outcome
from feelahead.benchmarks.error.spread import Spread, age_bins, by_compensation, over
from feelahead.benchmarks.error.tables import by_variant
from feelahead.lab.approaches.pulls import PULL_KINDS


class Figure(NamedTuple):
    """One number."""

    part: str
    method: str
    case: str
    at: str
    """The joint noise, or the loop age"""
    quantity: str
    value: float
    unit: str


def propagation_figures(outcomes: Sequence[Outcome], microseconds: Mapping[str, float]) -> Iterator[Figure]:
    """Truths, errors and run times."""
    for one in outcomes:
        case, at = f"{one.place}, {one.point}", f"{one.noise_rad:g} rad"
        truth = one.truth
        for quantity, value_m in (
            ("mean", truth.mean_m),
            ("sd", truth.sd_m),
            ("sd, standard error", truth.sd_error_m),
            ("quantile", truth.quantile_m),
            ("quantile, standard error", truth.quantile_error_m),
        ):
            yield Figure("propagation", "Monte Carlo", case, at, quantity, 1e3 * value_m, "mm")
        for method in METHODS:
            yield Figure("propagation", method, case, at, "mean", 1e3 * one.estimates[method].mean_m, "mm")
            yield Figure("propagation", method, case, at, "sd error", 100.0 * one.sd_error(method), "%")
            yield Figure("propagation", method, case, at, "covariance error", 100.0 * one.covariance_error(method), "%")
            yield Figure("propagation", method, case, at, "quantile error", 1e3 * one.quantile_error_m(method), "mm")
    for name, value in microseconds.items():
        yield Figure("propagation", name, "home, tool", "", "run time", value, "µs")


def prediction_figures(judged: Sequence[Judged]) -> Iterator[Figure]:
    """Errors by loop age, pull and kind."""
    for ages_s in age_bins():
        for pull in (None, *PULL_KINDS):
            for kind in COMPENSATIONS:
                found = over(judged, by_compensation(kind), ages_s=ages_s, pull=pull)
                yield from _spread_figures(kind, pull or "all", found)
        for kind in COMPENSATIONS:
            found = over(judged, by_compensation(kind), ages_s=ages_s, within_reach=False)
            yield from _spread_figures(kind, "edge of reach", found)
    for name in VARIANTS:
        yield from _spread_figures(f"operator, {name}", "all", over(judged, by_variant(name)))


def _spread_figures(kind: str, case: str, found: Spread) -> Iterator[Figure]:
    if found.count:
        at = f"{found.loop_age_ms:.0f} ms"
        yield Figure("prediction", kind, case, at, "moments", found.count, "")
        for quantity, value in (
            ("mean", found.mean_mm),
            ("sd", found.sd_mm),
            ("p99", found.p99_mm),
            ("max", found.max_mm),
        ):
            yield Figure("prediction", kind, case, at, quantity, value, "mm")


def write_figures(path: Path, figures: Sequence[Figure]) -> None:
    """One row for each under a heading."""
    with output_file("--csv", path) as file:
        writer = csv.writer(file)
        writer.writerow(Figure._fields)
        writer.writerows(figures)
