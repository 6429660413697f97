"""What the benchmark shows to people."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.error.prediction import COMPENSATIONS, VARIANTS, Compensation, Judged
from feelahead.benchmarks.error.propagation import METHODS, NOISE_RAD, PROBABILITY, Outcome
from feelahead.benchmarks.error.spread import Spread, age_bins, by_compensation, over
from feelahead.benchmarks.report import Table, short
from feelahead.lab.approaches.pulls import PULL_KINDS

SINGULAR: Final = "singular"
FAILS: Final = 0.05
"""Beyond this relative error a method has failed."""
KIND_NAMES: Final[Mapping[Compensation, str]] = {
    "operator": "own commands under way",
    "robot": "v t_d (eq. 8)",
    "momentary": "v times loop age",
}
Quantity = Callable[[Outcome, str], float]


def propagation_tables(outcomes: Sequence[Outcome], microseconds: Mapping[str, float]) -> list[Table]:
    """How wrong each method is, and what it costs."""
    settings = len({(one.place, one.point) for one in outcomes if one.place != SINGULAR})
    note = (
        f"Over {settings} points and configurations: the median and the worst; then the worst in the most singular of"
        " the sampled configurations. ±: one standard error of the truth."
    )
    return [
        _by_noise(
            outcomes,
            "Standard deviation along the approach axis: error in %",
            ("true, mm", lambda one: 1e3 * one.truth.sd_m, "± %", lambda one: _share(one.truth.sd_error_m, one)),
            lambda one, method: 100.0 * one.sd_error(method),
            note,
        ),
        _by_noise(
            outcomes,
            f"What eq. 10 needs, the quantile at P = {PROBABILITY:g}, from mean and standard deviation: error in mm",
            (
                "true, mm",
                lambda one: 1e3 * one.truth.quantile_m,
                "± mm",
                lambda one: 1e3 * one.truth.quantile_error_m,
            ),
            lambda one, method: 1e3 * one.quantile_error_m(method),
            "Above 0 is too far, on the safe side.",
        ),
        _by_noise(
            outcomes,
            "The whole covariance: error in % (Frobenius norm)",
            None,
            lambda one, method: 100.0 * one.covariance_error(method),
            "",
        ),
        Table(
            "Run time of one point and direction",
            ("method", "µs a call"),
            [(name, f"{value:.1f}") for name, value in microseconds.items()],
            "Processor time, the best of many short pieces. Once: that in the table at the start, nothing in a tick.",
        ),
    ]


def _share(value_m: float, one: Outcome) -> float:
    return 100.0 * value_m / one.truth.sd_m


def _by_noise(
    outcomes: Sequence[Outcome],
    title: str,
    truth: tuple[str, Callable[[Outcome], float], str, Callable[[Outcome], float]] | None,
    quantity: Quantity,
    note: str,
) -> Table:
    columns = ["joint noise, rad", *((truth[0], truth[2]) if truth else ())]
    for method in METHODS:
        columns += [f"{method}", "worst", SINGULAR]
    rows = []
    for noise_rad in NOISE_RAD:
        here = [one for one in outcomes if one.noise_rad == noise_rad]
        usual = [one for one in here if one.place != SINGULAR]
        cells = [f"{noise_rad:g}"]
        if truth:
            cells += [short(float(np.median([of(one) for one in usual]))) for of in (truth[1], truth[3])]
        for method in METHODS:
            errors = np.array([quantity(one, method) for one in usual])
            cells += [short(float(np.median(errors))), short(_worst(errors))]
            cells.append(short(_worst(np.array([quantity(one, method) for one in here if one.place == SINGULAR]))))
        rows.append(tuple(cells))
    return Table(title, tuple(columns), rows, note)


def _worst(errors: FloatArray) -> float:
    """The one of greatest magnitude, with its sign; NaN without any."""
    return float(errors[np.argmax(np.abs(errors))]) if errors.size else float("nan")


def failures(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Sentences: from which joint noise on the linear propagation is off by more than FAILS."""
    groups: dict[str, list[Outcome]] = {"at home": [], "in the random configurations": [], "in the singular one": []}
    for one in outcomes:
        name = {"home": "at home", SINGULAR: "in the singular one"}.get(one.place, "in the random configurations")
        groups[name].append(one)
    for what, error in (
        ("standard deviation", Outcome.sd_error),
        (f"quantile at {PROBABILITY:g}", Outcome.quantile_error),
    ):
        parts = []
        for name, members in groups.items():
            off = {one.noise_rad for one in members if abs(error(one, "linear")) > FAILS}
            parts.append(f"{name} from {min(off):g} rad on" if off else f"{name} not up to {max(NOISE_RAD):g} rad")
        yield f"linear, {what}: off by more than {100.0 * FAILS:g} % {', '.join(parts)}"


def prediction_tables(judged: Sequence[Judged]) -> list[Table]:
    """How wrong each prediction of the displacement is."""
    columns = ("loop age, ms", "moments", *(KIND_NAMES[kind] for kind in COMPENSATIONS))
    note = "Truth less prediction, mm: mean, standard deviation, 99 % of the magnitudes, greatest."
    overall, by_pull, edge = [], [], []
    for ages_s in age_bins():
        spreads = [over(judged, by_compensation(kind), ages_s=ages_s) for kind in COMPENSATIONS]
        if spreads[0].count:
            overall.append((*_head(spreads[0]), *map(cell, spreads)))
        for pull in PULL_KINDS:
            spreads = [over(judged, by_compensation(kind), ages_s=ages_s, pull=pull) for kind in COMPENSATIONS]
            if spreads[0].count:
                age, count = _head(spreads[0])
                by_pull.append((age, pull, count, *map(cell, spreads)))
        spreads = [
            over(judged, choose, ages_s=ages_s, within_reach=False)
            for choose in (by_compensation("operator"), by_variant("v_max as set"), by_compensation("robot"))
        ]
        if spreads[0].count:
            edge.append((*_head(spreads[0]), *map(cell, spreads)))
    return [
        Table("Displacement until a command takes effect: what predictions miss", columns, overall, note),
        Table("The same by pull", (columns[0], "pull", *columns[1:]), by_pull),
        Table(
            "At the edge of the arm's reach, where it cannot do what it is told",
            (*columns[:2], KIND_NAMES["operator"], "the same, v_max as set", KIND_NAMES["robot"]),
            edge,
            "Not in the tables above. v_max: what full travel gives in the pose of the report.",
        ),
        Table(
            "What the prediction by the commands under way takes for v_max and a",
            ("", "moments", "within reach", "at the edge"),
            [_variant_row(judged, name) for name in VARIANTS],
            "a: how fast the speed along the approach changes.",
        ),
    ]


def by_variant(name: str) -> Callable[[Judged], FloatArray]:
    """The errors (k,) of one of VARIANTS."""
    return lambda one: one.by_variant_m[name]


def _variant_row(judged: Sequence[Judged], name: str) -> tuple[str, ...]:
    within = over(judged, by_variant(name))
    return name, str(within.count), cell(within), cell(over(judged, by_variant(name), within_reach=False))


def _head(found: Spread) -> tuple[str, str]:
    return f"{found.loop_age_ms:.0f}", str(found.count)


def cell(found: Spread) -> str:
    """Mean, standard deviation, 99 % and greatest, in mm."""
    if not found.count:
        return "-"
    return f"{found.mean_mm:+.2f}  {found.sd_mm:.2f}  {found.p99_mm:.2f}  {found.max_mm:.2f}"
