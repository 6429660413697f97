"""Errors of many moments in a few figures, by loop age, pull and kind of compensation; and the table for eq. 10."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.error.prediction import COMPENSATIONS, Compensation, Judged
from feelahead.lab.approaches.pulls import PullKind

LOOP_AGE_EDGES_S: Final = (0.0, 0.02, 0.06, 0.13, 0.28, 0.58, 1.2)
"""Between these, approaches are taken together by the median of their loop age. The single moment's does not choose:
where it is short by chance the command sent now takes longer than what was heard, and that would pass for an error."""
Choose = Callable[[Judged], FloatArray]


@dataclass(frozen=True)
class Spread:
    """How errors are distributed, in millimetres; NaN without any."""

    count: int
    loop_age_ms: float
    """The mean"""
    mean_mm: float
    sd_mm: float
    p99_mm: float
    """Of the magnitude, as the greatest is."""
    max_mm: float


def spread(errors_m: FloatArray, loop_age_s: FloatArray) -> Spread:
    """Over all errors (k,) that there are; NaN stands for a prediction that was not made."""
    known = ~np.isnan(errors_m)
    errors_mm, ages_ms = 1e3 * errors_m[known], 1e3 * loop_age_s[known]
    if errors_mm.size == 0:
        return Spread(0, *[float("nan")] * 5)
    magnitudes = np.abs(errors_mm)
    return Spread(
        count=int(errors_mm.size),
        loop_age_ms=float(ages_ms.mean()),
        mean_mm=float(errors_mm.mean()),
        sd_mm=float(errors_mm.std()),
        p99_mm=float(np.quantile(magnitudes, 0.99)),
        max_mm=float(magnitudes.max()),
    )


def over(
    judged: Sequence[Judged],
    choose: Choose,
    *,
    ages_s: tuple[float, float] = (0.0, np.inf),
    pull: PullKind | None = None,
    within_reach: bool = True,
) -> Spread:
    """What `choose` takes of each, with loop ages from the first to below the second, of one kind of pull or of all.

    within_reach: of the moments in which the arm could do what it was told; else of the others.
    """
    errors, ages = [np.empty(0)], [np.empty(0)]
    for one in judged:
        if one.loop_age_s.size and (pull is None or one.pull == pull):
            if not ages_s[0] <= float(np.median(one.loop_age_s)) < ages_s[1]:
                continue
            wanted = one.within_reach == within_reach
            errors.append(choose(one)[wanted])
            ages.append(one.loop_age_s[wanted])
    return spread(np.concatenate(errors), np.concatenate(ages))


def age_bins() -> Iterator[tuple[float, float]]:
    """From and to, in seconds."""
    return pairwise(LOOP_AGE_EDGES_S)


def by_compensation(kind: Compensation) -> Choose:
    """The errors (k,) of one kind of prediction."""
    return lambda one: one.errors_m[kind]


def error_table(judged: Sequence[Judged], arm: str, frozen: str, full_speed_m_s: float) -> str:
    """μ_δ and σ_δ of eq. 10 over loop age and kind of compensation, as TOML; bins without a moment are left out.

    arm: the fingerprint of the one that they were measured on.
    """
    pulls, links = (", ".join(f'"{name}"' for name in dict.fromkeys(names)) for names in _names(judged))
    lines = [
        "# How wrong the predicted displacement is: truth less prediction along the direction in which R2 advances, so",
        "# that mu_mm above 0 is a gripper farther ahead than predicted. p99_mm is of the magnitude.",
        "# [[operator]]: by the commands under way, as their sender knows them. [[robot]]: v t_d, t_d the robot's high",
        "# quantile of the loop age (eq. 8). [[momentary]]: v times the present loop age. Moments at the edge of the",
        "# arm's reach, where it cannot do what it is told, are not in it.",
        f'arm = "{arm}"',
        f'frozen = "{frozen}"',
        f"full_speed_m_s = {full_speed_m_s:g}",
        f"pulls = [{pulls}]",
        f"links = [{links}]",
        f"seeds = {sorted({one.seed for one in judged})}",
    ]
    for kind in COMPENSATIONS:
        for ages_s in age_bins():
            found = over(judged, by_compensation(kind), ages_s=ages_s)
            if found.count:
                lines += ["", f"[[{kind}]]", f"loop_age_ms = {found.loop_age_ms:.1f}"]
                lines += [f"{key} = {value:.4f}" for key, value in _keys(found)]
                lines.append(f"n = {found.count}")
    return "\n".join(lines) + "\n"


def _names(judged: Sequence[Judged]) -> tuple[list[str], list[str]]:
    return [one.pull for one in judged], [one.link for one in judged]


def _keys(found: Spread) -> tuple[tuple[str, float], ...]:
    return ("mu_mm", found.mean_mm), ("sigma_mm", found.sd_mm), ("p99_mm", found.p99_mm)
