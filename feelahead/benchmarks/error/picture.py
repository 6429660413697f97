"""Run time against error of the propagation, and the predictions' errors against the loop age."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from feelahead.benchmarks.error.prediction import COMPENSATIONS, Compensation, Judged
from feelahead.benchmarks.error.propagation import NOISE_RAD, Outcome
from feelahead.benchmarks.error.running_time import monte_carlo_errors
from feelahead.benchmarks.error.spread import age_bins, by_compensation, over
from feelahead.benchmarks.error.tables import KIND_NAMES, SINGULAR

_COLOURS: Final = {"linear": "#0072b2", "unscented": "#d55e00", "Monte Carlo": "#777777", "once": "#009e73"}
_KIND_COLOURS: Final[Mapping[Compensation, str]] = {"operator": "#0072b2", "robot": "#d55e00", "momentary": "#cc79a7"}
_ROOM_PERCENT: Final = 1e5
"""So that the legend covers nothing."""
_LEAST_MM: Final = 0.01
"""The axis is logarithmic."""


def draw(
    outcomes: Sequence[Outcome],
    microseconds: Mapping[str, float],
    judged: Sequence[Judged],
    frozen: str,
    path: Path,
) -> None:
    """Both panels as one PNG."""
    import matplotlib as mpl  # noqa: PLC0415

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.4), dpi=110, layout="constrained")
    _draw_propagation(left, outcomes, microseconds)
    _draw_prediction(right, judged)
    figure.suptitle(f"frozen {frozen}", fontsize=8)
    figure.savefig(path)
    plt.close(figure)


def _draw_propagation(axes: Any, outcomes: Sequence[Outcome], microseconds: Mapping[str, float]) -> None:
    certainty = 100.0 * float(np.median([one.truth.sd_error_m / one.truth.sd_m for one in outcomes]))
    for method, timed in (("linear", "linear, with kinematics"), ("unscented", "unscented")):
        for place, mark, label in ((None, "o", method), (SINGULAR, "x", f"{method}, in the singular configuration")):
            errors = [100.0 * _median_error(outcomes, method, noise_rad, place) for noise_rad in NOISE_RAD]
            told = {noise_rad: error for noise_rad, error in zip(NOISE_RAD, errors, strict=True) if error > certainty}
            time_us = microseconds[timed]
            shown = list(told.values()) or [certainty]
            axes.plot([time_us] * len(shown), shown, mark, color=_COLOURS[method], label=label)
            for noise_rad, error in told.items():
                axes.annotate(f"{noise_rad:g} rad", (time_us, error), (5, -3), textcoords="offset points", fontsize=6)
    drawn = dict(monte_carlo_errors())
    axes.plot(
        [microseconds[name] for name in drawn],
        [100.0 * error for error in drawn.values()],
        "s-",
        color=_COLOURS["Monte Carlo"],
        label="Monte Carlo of 100, 1000, 10000",
    )
    once = 100.0 * _median_error(outcomes, "once", NOISE_RAD[0], None)
    axes.axhline(once, color=_COLOURS["once"], linestyle="--", label="once (nothing in a tick)")
    axes.axhline(certainty, color="black", linewidth=0.6, linestyle=":", label="the truth's standard error")
    axes.set(xscale="log", yscale="log", xlabel="processor time of a call, µs")
    axes.set(ylabel="error of the standard deviation, %", ylim=(None, _ROOM_PERCENT))
    axes.set_title("Error propagation, median configuration (less noise: within the truth's error)", fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="upper right")


def _median_error(outcomes: Sequence[Outcome], method: str, noise_rad: float, place: str | None) -> float:
    """Of all places but the singular one, or of one place; NaN without any."""
    errors = [
        abs(one.sd_error(method))
        for one in outcomes
        if one.noise_rad == noise_rad and (one.place == place if place else one.place != SINGULAR)
    ]
    return float(np.median(errors)) if errors else float("nan")


def _draw_prediction(axes: Any, judged: Sequence[Judged]) -> None:
    for kind in COMPENSATIONS:
        found = [over(judged, by_compensation(kind), ages_s=ages_s) for ages_s in age_bins()]
        found = [one for one in found if one.count]
        colour, label = _KIND_COLOURS[kind], KIND_NAMES[kind]
        ages = [one.loop_age_ms for one in found]
        axes.plot(ages, [max(one.p99_mm, _LEAST_MM) for one in found], "o-", color=colour, label=f"{label}: 99 %")
        axes.plot(ages, [max(one.sd_mm, _LEAST_MM) for one in found], ".--", color=colour, label="standard deviation")
    axes.set(yscale="log", xlabel="loop age, ms", ylabel="error, mm")
    axes.set_title("Displacement until a command takes effect, what predictions miss", fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
