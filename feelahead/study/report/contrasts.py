"""Planned contrasts: two conditions in pairs of trials with the same delay, scene and repetition."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from common.arrays import FloatArray
from feelahead.study.protocol import Contrast
from feelahead.study.report.models import Fit, fit
from feelahead.study.report.outcomes import Kind, Outcome, Tables, measured, outcome_of, scale
from feelahead.study.report.participants import cohens_d_z, mean_interval, sign_change_p

_PAIR = ["participant", "delay_ms", "scene", "repeat"]


@dataclass(frozen=True)
class Pairs:
    """Pairs of trials, which differ in the condition alone."""

    rows: Any
    """Values of both conditions, as `measured` returns them"""
    participants: tuple[int, ...]
    first: FloatArray
    """Each participant's mean under the first condition, on the scale of `scale`; shape (participants,)"""
    second: FloatArray

    @property
    def differences(self) -> FloatArray:
        """First minus second; shape (participants,)"""
        return self.first - self.second


def pairs_of(rows: Any, kind: Kind, first: str, second: str) -> Pairs:
    """Return the pairs in `rows` of which both values are known."""
    rows = rows.reset_index(drop=True)
    one, other = (rows[rows.condition == name].reset_index() for name in (first, second))
    pairs = one.merge(other, on=_PAIR)
    means = scale(kind, pairs[["value_x", "value_y"]]).groupby(pairs.participant).mean()
    kept = rows.loc[[*pairs.index_x, *pairs.index_y]]
    people = tuple(map(int, means.index))
    return Pairs(kept, people, means.value_x.to_numpy(np.float64), means.value_y.to_numpy(np.float64))


@dataclass(frozen=True)
class Effect:
    """Effect of the first condition against the second, each participant counting alike."""

    participants: int
    pairs: int
    value_first: float | None
    """Mean over participants; of a factor, the geometric mean"""
    value_second: float | None
    measure: str
    """ratio, or difference (of a share: in 0 to 1)"""
    effect: float | None
    low: float | None
    """End of the 95 % interval by a bootstrap over participants; None for fewer than three, or all alike"""
    high: float | None


@dataclass(frozen=True)
class Compared:
    """Planned contrast, and what was found."""

    contrast: Contrast
    effect: Effect
    d_z: tuple[float, float, float] | None
    """Cohen's d_z, and its interval's ends"""
    fit: Fit
    p_exact: float | None
    """Of the test by changes of sign of the participants' differences"""
    p_holm: float | None = None
    """The model's p with Holm's correction in its family"""

    @property
    def row(self) -> dict[str, Any]:
        """Figures by name, for a table"""
        d_z = self.d_z or (None, None, None)
        return (
            asdict(self.contrast)
            | asdict(self.effect)
            | dict(zip(("d_z", "d_z_low", "d_z_high"), d_z, strict=True))
            | {name if name == "model" else f"model_{name}": value for name, value in asdict(self.fit).items()}
            | {"p_holm": self.p_holm, "p_exact": self.p_exact}
        )


def compare(tables: Tables) -> tuple[Compared, ...]:
    """Return what was found for each contrast of the protocol."""
    found = [_compare(tables, contrast) for contrast in tables.protocol.contrasts]
    corrected = holm([(one.contrast.correct, one.fit.p) for one in found])
    return tuple(replace(one, p_holm=p) for one, p in zip(found, corrected, strict=True))


def _compare(tables: Tables, contrast: Contrast) -> Compared:
    outcome, seed = outcome_of(contrast.outcome), tables.protocol.seed
    pairs = pairs_of(measured(tables, outcome), outcome.kind, contrast.first, contrast.second)
    known = len(pairs.differences) > 0
    return Compared(
        contrast,
        effect_of(pairs, outcome, seed),
        cohens_d_z(pairs.differences),
        fit(pairs.rows, outcome.kind, contrast.first),
        sign_change_p(pairs.differences, seed) if known else None,
    )


def effect_of(pairs: Pairs, outcome: Outcome, seed: int) -> Effect:
    """Return the mean over participants of their differences, with an interval that respects them as clusters."""
    factor = outcome.kind is Kind.FACTOR
    count, measure = len(pairs.differences), "ratio" if factor else "difference"
    if count == 0:
        return Effect(0, 0, None, None, measure, None, None, None)
    middle, first, second = (float(part.mean()) for part in (pairs.differences, pairs.first, pairs.second))
    low, high = mean_interval(pairs.differences, seed) or (None, None)
    figures = [None if one is None else float(np.exp(one)) if factor else one for one in (middle, low, high)]
    values = np.exp([first, second]) if factor else np.array([first, second])
    return Effect(count, len(pairs.rows) // 2, float(values[0]), float(values[1]), measure, *figures)


def effects_by(tables: Tables, column: str) -> tuple[tuple[Contrast, Any, Effect], ...]:
    """Return each contrast's effect at each level of `column`, delay_ms or scene: to explore, without a test."""
    found = []
    for contrast in tables.protocol.contrasts:
        outcome = outcome_of(contrast.outcome)
        if outcome.kind is not Kind.ANSWER:
            for level, rows in measured(tables, outcome).groupby(column):
                pairs = pairs_of(rows, outcome.kind, contrast.first, contrast.second)
                found.append((contrast, level, effect_of(pairs, outcome, tables.protocol.seed)))
    return tuple(found)


def holm(tests: Sequence[tuple[str, float | None]]) -> tuple[float | None, ...]:
    """Return each p with Holm's correction among those of its family; None stays None, and counts as a test with p = 1.

    tests: family and p of each.
    """
    from statsmodels.stats.multitest import multipletests  # noqa: PLC0415

    corrected: dict[int, float] = {}
    for family in {name for name, _ in tests}:
        places = [place for place, (name, _) in enumerate(tests) if name == family]
        raw = [1.0 if (p := tests[place][1]) is None else p for place in places]
        corrected |= dict(zip(places, map(float, multipletests(raw, method="holm")[1]), strict=True))
    return tuple(None if p is None else corrected[place] for place, (_, p) in enumerate(tests))
