"""Power of a protocol's contrasts by the number of participants, by resampling simulated ones."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.stats import binomtest, t

from common.arrays import FloatArray
from common.errors import ConfigurationError
from feelahead.study.protocol import Contrast, Protocol
from feelahead.study.report.contrasts import pairs_of
from feelahead.study.report.outcomes import OUTCOMES, Kind, Tables, measured, outcome_of
from feelahead.study.report.participants import alike_p, are_alike

LEVEL: Final = 0.05
ASKED: Final = (0.8, 0.9)
"""Powers for which the smallest number of participants is told"""
_SHARED: Final = ("conditions", "contrasts", "delays_ms", "scenes", "trials", "limit_s")
"""What a pool's protocol has to have in common with the protocol that is planned"""
_MOST: Final = 64
"""Participants up to which it is looked for"""


@dataclass(frozen=True)
class Power:
    """Share of studies with this many participants in which a contrast is found, after Holm's correction."""

    contrast: Contrast
    participants: int
    effect: float
    """Size of the simulated mean effect that is assumed: 1 as simulated, 0.5 half of it"""
    power: float
    low: float
    """End of the exact 95 % interval, as studies were drawn at random"""
    high: float


@dataclass(frozen=True)
class Plan:
    """Power by number of participants."""

    pool: int
    """Number of simulated participants that were drawn from"""
    resamples: int
    rows: tuple[Power, ...]
    untold: tuple[Contrast, ...] = ()
    """Contrasts of outcomes that the simulated participants lack, such as answers"""
    enlargements_mm: tuple[tuple[str, float], ...] = ()
    """Conditions, each with the mean enlargement while the tool moved: what a fair `margin_m` equals"""

    def smallest(self, contrast: Contrast, power: float, effect: float = 1.0) -> int | None:
        """Return the smallest number from which on `power` is within reach; None if none of those tried is enough.

        Within reach: the lower end of the interval is not below it, for this and each larger number.
        """
        rows = [row for row in self.rows if row.contrast == contrast and row.effect == effect]
        enough = None
        for row in sorted(rows, key=lambda one: -one.participants):
            if row.low < power:
                break
            enough = row.participants
        return enough


def balanced_sizes(protocol: Protocol) -> tuple[int, ...]:
    """Return the numbers of participants at which each order of conditions comes equally often."""
    count = len(protocol.conditions)
    period = 2 * count if count % 2 else count
    return tuple(range(period, _MOST + 1, period))


def require_pool(protocol: Protocol, pool: Tables) -> None:
    """Raise ConfigurationError if participants of `pool` cannot stand for those of a study by this protocol."""
    if not pool.simulated:
        raise ConfigurationError("--pool: people took part in it; valid: a study with simulated persons")
    other = [name for name in _SHARED if getattr(protocol, name) != getattr(pool.protocol, name)]
    if other:
        raise ConfigurationError(f"--pool: has other {', '.join(other)}; valid: a pool that has those of the protocol")


def plan(
    tables: Tables,
    sizes: Sequence[int] | None = None,
    resamples: int = 2_000,
    effects: Sequence[float] = (1.0, 0.5),
    seed: int | None = None,
) -> Plan:
    """Return the power of each contrast of the protocol, by drawing participants from a pool of simulated ones.

    In a study without gaps the paired t of participants' means stands for the models: the mixed model with slopes gives
    the same, linear estimating equations the same with a slightly wider error, others nearly. tables: the pool's.
    effects: sizes of the mean effect, each as a share of the simulated one; differences between participants stay.
    seed: the protocol's if None. ConfigurationError for a pool or sizes that are too small, or without contrasts.
    """
    protocol = tables.protocol
    sizes = balanced_sizes(protocol) if sizes is None else sizes
    if not protocol.contrasts:
        raise ConfigurationError("contrasts: none; valid: one or more, whose power is asked")
    if min(sizes, default=0) < 3:
        raise ConfigurationError(f"participants = {min(sizes, default=0)}; valid: 3 or more")
    known, differences = _differences(tables)
    untold = tuple(one for one in protocol.contrasts if one not in known)
    # What the pool does not tell is a test all the same, and takes its share of the level.
    families = [one.correct for one in (*known, *untold)]
    estimating = np.array([[outcome_of(one.outcome).kind in (Kind.SHARE, Kind.AMOUNT)] for one in known])

    def errors(size: int) -> FloatArray:
        """Return by what the models' standard errors are wider: Mancl's and DeRouen's covariance."""
        return np.where(estimating, np.sqrt(size / (size - 1)), 1.0)

    generator = np.random.default_rng(protocol.seed if seed is None else seed)
    rows = []
    for effect in effects:
        middles = differences.mean(axis=1, keepdims=True)
        assumed = differences - (1.0 - effect) * middles
        for size in sizes:
            drawn = generator.integers(differences.shape[1], size=(resamples, size))
            raw = np.concatenate([_paired_t_p(assumed[:, drawn], errors(size)), np.ones((len(untold), resamples))])
            for contrast, p in zip(known, _holm(raw, families), strict=False):
                count = int(np.count_nonzero(p <= LEVEL))
                interval = binomtest(count, resamples).proportion_ci(0.95, method="exact")
                found = (count / resamples, float(interval.low), float(interval.high))
                rows.append(Power(contrast, size, effect, *found))
    means_mm = measured(tables, OUTCOMES["enlargement_mm"]).groupby("condition").value.mean()
    return Plan(differences.shape[1], resamples, tuple(rows), untold, tuple(means_mm.items()))


def _differences(tables: Tables) -> tuple[tuple[Contrast, ...], FloatArray]:
    """Return the contrasts that the pool's outcomes tell, and differences, shape (contrasts, pool)."""
    import pandas as pd  # noqa: PLC0415

    found: dict[Contrast, Any] = {}
    for one in tables.protocol.contrasts:
        outcome = outcome_of(one.outcome)
        pairs = pairs_of(measured(tables, outcome), outcome.kind, one.first, one.second)
        if pairs.participants:
            found[one] = pd.Series(pairs.differences, index=pairs.participants)
    complete = pd.concat(found.values(), axis=1).dropna() if found else pd.DataFrame()
    if len(complete) < 3:
        raise ConfigurationError(f"pool: {len(complete)} participants are in every contrast; valid: 3 or more")
    return tuple(found), complete.to_numpy(np.float64).T


def _paired_t_p(differences: FloatArray, wider: FloatArray) -> FloatArray:
    """Return Student's two-sided p over the last axis; where all differences are alike, that of the exact test.

    differences: (contrasts, resamples, participants). wider: factors of the standard error, (contrasts, 1).
    """
    count = differences.shape[-1]
    middles, spreads = differences.mean(axis=-1), differences.std(axis=-1, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        p = 2.0 * t.sf(np.abs(middles) / (wider * spreads) * np.sqrt(count), count - 1)
    found: FloatArray = np.where(are_alike(differences), alike_p(middles, count), p)
    return found


def _holm(p: FloatArray, families: Sequence[str]) -> FloatArray:
    """Return p, shape (contrasts, resamples), with Holm's correction among the contrasts of a family."""
    corrected = np.empty_like(p)
    for family in set(families):
        places = np.flatnonzero([name == family for name in families])
        order = np.argsort(p[places], axis=0)
        ranked = np.take_along_axis(p[places], order, axis=0) * np.arange(len(places), 0, -1)[:, None]
        stepped = np.minimum(np.maximum.accumulate(ranked, axis=0), 1.0)
        part = np.empty_like(stepped)
        np.put_along_axis(part, order, stepped, axis=0)
        corrected[places] = part
    return corrected
