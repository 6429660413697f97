"""Models of the rows of two conditions, by statsmodels: the effect of the condition beside delay and scene.

Shares and amounts: generalized estimating equations with an exchangeable correlation within participants, and Mancl's
and DeRouen's covariance, as participants are few (Biometrics 57, 2001). Others: a mixed linear model with an intercept
and a slope of the condition for each participant. All are judged by Student's t with one degree less than participants.
Where all participants differ alike, the spread between persons is unknown: the exact test stands for the model.
statsmodels' Bayesian binomial model gives an approximate posterior, which is too narrow to be a test; it is not used.
"""

import warnings
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.stats import t

from common.arrays import FloatArray
from feelahead.study.report.outcomes import Kind, scale
from feelahead.study.report.participants import alike_p, are_alike, paired_t

_FEWEST: Final = 3
"""Participants for whom a model is fitted"""
_GEE: Final = {Kind.SHARE: ("logistic GEE", "odds ratio"), Kind.AMOUNT: ("log-linear GEE", "ratio of means")}
_LINEAR_GEE: Final = "linear GEE"
EXACT: Final = "exact test of sign changes"
ALIKE: Final = "all participants alike"
"""Why there is no interval, and the exact test stands for a model"""


@dataclass(frozen=True)
class Fit:
    """Effect of the first condition against the second."""

    model: str
    """What was fitted"""
    measure: str = ""
    """What the estimate is: difference, or a ratio"""
    estimate: float | None = None
    low: float | None = None
    high: float | None = None
    p: float | None = None
    note: str = ""
    """Why another model was fitted than planned, or none"""


def fit(rows: Any, kind: Kind, first: str) -> Fit:
    """Fit the planned model of `kind`; where it has no solution the next simpler one, which the note says.

    rows: as `measured` returns them, of two conditions; each participant has both. first: the condition whose effect is
    asked.
    """
    count = rows.participant.nunique()
    if count < _FEWEST:
        return Fit("none", note=f"{count} participants; a model needs {_FEWEST}")
    rows = rows.sort_values(["participant", "condition", "delay_ms", "scene", "repeat"])
    values = np.asarray(scale(kind, rows.value), dtype=np.float64)
    differences = _differences(rows, values, first)
    if are_alike(differences):
        factor, middle = kind is Kind.FACTOR, float(differences.mean())
        measure, estimate = ("ratio", float(np.exp(middle))) if factor else ("difference", middle)
        return Fit(EXACT, measure, estimate, p=float(alike_p(middle, count)), note=ALIKE)
    if kind is Kind.ANSWER:
        return _paired(differences)
    design, groups = _design(rows, first), rows.participant.to_numpy()
    if kind is Kind.SHARE or kind is Kind.AMOUNT:
        return _estimated(design, values, groups, kind)
    return _mixed(design, values, groups, kind)


def _design(rows: Any, first: str) -> FloatArray:
    """Return the columns: one, condition, and each delay and scene but the first."""
    columns = [np.ones(len(rows)), rows.condition == first]
    for name in ("delay_ms", "scene"):
        columns += [rows[name] == level for level in sorted(rows[name].unique())[1:]]
    return np.column_stack(columns).astype(np.float64)


def _estimated(design: FloatArray, values: FloatArray, groups: Any, kind: Kind) -> Fit:
    """Fit estimating equations; linear ones where a condition, delay or scene has no hits, or hits alone."""
    from statsmodels.genmod import families  # noqa: PLC0415

    (name, measure), family = _GEE[kind], families.Binomial() if kind is Kind.SHARE else families.Poisson()
    found = None if _is_separated(design, values, kind) else _gee(design, values, groups, family)
    if found is not None:
        return _fit(name, measure, *found, len(np.unique(groups)), exponential=True)
    reason = f"{name}: no solution, as outcomes do not vary somewhere"
    found = _gee(design, values, groups, families.Gaussian())
    if found is None:
        return Fit("none", note=f"{reason}; nor has the {_LINEAR_GEE}")
    return _fit(_LINEAR_GEE, "difference", *found, len(np.unique(groups)), note=reason)


def _is_separated(design: FloatArray, values: FloatArray, kind: Kind) -> bool:
    """Return whether the values within a condition, delay or scene are all zero (of a share: or all one)."""
    parts = [values[design[:, column] == level] for column in range(1, design.shape[1]) for level in (0.0, 1.0)]
    return any(part.max(initial=0.0) == 0.0 or (kind is Kind.SHARE and part.min(initial=1.0) == 1.0) for part in parts)


def _gee(design: FloatArray, values: FloatArray, groups: Any, family: Any) -> tuple[float, float] | None:
    """Return estimate and standard error; None without a solution."""
    from statsmodels.genmod.cov_struct import Exchangeable  # noqa: PLC0415
    from statsmodels.genmod.generalized_estimating_equations import GEE  # noqa: PLC0415

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            found = GEE(values, design, groups=groups, family=family, cov_struct=Exchangeable()).fit(
                cov_type="bias_reduced"
            )
        except (np.linalg.LinAlgError, ValueError):
            return None
        return _usable(found, bool(found.converged))


def _mixed(design: FloatArray, values: FloatArray, groups: Any, kind: Kind) -> Fit:
    """Fit a mixed linear model with slopes; without slopes where that has no solution."""
    from statsmodels.regression.mixed_linear_model import MixedLM  # noqa: PLC0415

    factor = kind is Kind.FACTOR
    name, measure = ("mixed model of the logarithm", "ratio") if factor else ("mixed model", "difference")
    for random, how in ((design[:, :2], "intercepts and slopes"), (design[:, :1], "intercepts")):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            try:
                result = MixedLM(values, design, groups=groups, exog_re=random).fit(reml=True, method=["lbfgs", "bfgs"])
                found = _usable(result, bool(result.converged))
            except (np.linalg.LinAlgError, ValueError):
                found = None
        if found is not None:
            note = "" if random.shape[1] == 2 else "with slopes of the condition it did not converge"
            return _fit(
                f"{name}, {how} by participant",
                measure,
                *found,
                len(np.unique(groups)),
                exponential=factor,
                note=note,
            )
    return Fit("none", note=f"{name}: did not converge")


def _usable(result: Any, converged: bool) -> tuple[float, float] | None:
    estimate, error = float(result.params[1]), float(result.bse[1])
    return (estimate, error) if converged and np.isfinite(estimate) and np.isfinite(error) and error > 0.0 else None


def _fit(
    model: str, measure: str, estimate: float, error: float, count: int, *, exponential: bool = False, note: str = ""
) -> Fit:
    """Return the fit of an estimate with its standard error from `count` participants."""
    half = float(t.ppf(0.975, count - 1)) * error
    p = float(2.0 * t.sf(abs(estimate) / error, count - 1))
    ends = np.array([estimate, estimate - half, estimate + half])
    middle, low, high = (float(end) for end in (np.exp(ends) if exponential else ends))
    return Fit(model, measure, middle, low, high, p, note)


def _differences(rows: Any, values: FloatArray, first: str) -> FloatArray:
    """Return each participant's mean under the first condition less that under the other; shape (participants,)."""
    wide = rows.assign(scaled=values).pivot_table(index="participant", columns="condition", values="scaled")
    found: FloatArray = (wide[first] - wide.drop(columns=first).iloc[:, 0]).dropna().to_numpy(np.float64)
    return found


def _paired(differences: FloatArray) -> Fit:
    found = paired_t(differences)
    if found is None:
        return Fit("none", note=f"{len(differences)} participants; a test needs {_FEWEST}")
    p, low, high = found
    return Fit("paired t", "difference", float(differences.mean()), low, high, p)
