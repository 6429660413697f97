"""Figures and sentences of a report, as text."""

from typing import Any, Final

import numpy as np

from feelahead.study.protocol import Condition, Contrast, Protocol
from feelahead.study.report.contrasts import Compared, Effect
from feelahead.study.report.models import ALIKE
from feelahead.study.report.outcomes import Kind, Outcome, outcome_of

ABSENT: Final = "–"


def number(value: Any, digits: int = 3) -> str:
    """Return a figure with so many significant digits; a dash for none."""
    if value is None or not np.isfinite(value):
        return ABSENT
    if value == 0.0:
        return "0"
    places = max(0, digits - 1 - int(np.floor(np.log10(abs(value)))))
    return f"{value:.{min(places, 6)}f}".replace("-", "−")


def p_value(p: float | None) -> str:
    """Return p with three places, as journals ask for it."""
    if p is None:
        return ABSENT
    return "<0.001" if p < 0.001 else f"{p:.3f}"


def interval(low: float | None, high: float | None, factor: float = 1.0) -> str:
    """Return an interval in brackets; a dash for none."""
    if low is None or high is None or not (np.isfinite(low) and np.isfinite(high)):
        return ABSENT
    return f"[{number(factor * low)}, {number(factor * high)}]"


def in_unit(outcome: Outcome, value: float | None) -> str:
    """Return a value of an outcome with its unit."""
    if value is None:
        return ABSENT
    return f"{number(value * factor_of(outcome))} {outcome.unit}".strip()


def factor_of(outcome: Outcome) -> float:
    """Return by what values are multiplied for showing: shares are shown in per cent."""
    return 100.0 if outcome.kind is Kind.SHARE else 1.0


def named(contrast: Contrast) -> str:
    """Return a contrast's short name."""
    return f"{outcome_of(contrast.outcome).title}: {contrast.first} / {contrast.second}"


def effect_words(outcome: Outcome, effect: Effect) -> str:
    """Return an effect with its unit and interval."""
    if effect.effect is None:
        return ABSENT
    if effect.measure == "ratio":
        return f"× {number(effect.effect)} {interval(effect.low, effect.high)}"
    unit = "points" if outcome.kind is Kind.SHARE else outcome.unit
    factor = factor_of(outcome)
    return f"{number(factor * effect.effect)} {unit} {interval(effect.low, effect.high, factor)}".replace("  ", " ")


def sentence(one: Compared) -> str:
    """Return what a contrast found, as a sentence for a person who does not read tables."""
    outcome, effect = outcome_of(one.contrast.outcome), one.effect
    if effect.effect is None:
        return f"{named(one.contrast)}: no pair of trials; nothing can be said."
    mean = "geometric mean" if outcome.kind is Kind.FACTOR else "mean"
    words = (
        f"{outcome.title[:1].upper()}{outcome.title[1:]}: {in_unit(outcome, effect.value_first)} with"
        f" {one.contrast.first}, {in_unit(outcome, effect.value_second)} with {one.contrast.second} ({mean} of"
        f" {effect.participants} participants); {effect.measure} {effect_words(outcome, effect)}"
    )
    if one.fit.note == ALIKE:
        words += f" ({ALIKE})"
    if one.p_holm is None:
        return f"{words}; not tested: {one.fit.note}."
    found = "a difference" if one.p_holm <= 0.05 else "no difference is shown, which does not show that there is none"
    p = f"p = {p_value(one.p_holm)}".replace("= <", "< ")
    return f"{words}; {p} after Holm’s correction: {found}."


def settings_of(condition: Condition) -> str:
    """Return what a condition is."""
    margin = "" if condition.margin_m is None else f" of {1e3 * condition.margin_m:g} mm"
    haptics = f"law {condition.law}{margin}" if condition.haptics else "no haptics"
    return haptics if condition.assist == "none" else f"{haptics}, assist of {condition.assist}"


def models(protocol: Protocol) -> tuple[str, ...]:
    """Return how each kind of outcome that a contrast names is analysed, in sentences."""
    kinds = {outcome_of(one.outcome).kind for one in protocol.contrasts}
    told = {
        Kind.SHARE: "A share of trials is compared by a logistic model of generalized estimating equations. Where a"
        " condition, delay or scene has no variation, that model has no solution; a linear one takes its place. Effect:"
        " the difference of shares.",
        Kind.AMOUNT: "An amount that is zero in many trials is compared by a log-linear model of generalized estimating"
        " equations. Where a condition, delay or scene has zeros alone, a linear one takes its place. Effect: the"
        " difference of means.",
        Kind.FACTOR: "A time or path is compared by a mixed linear model of its logarithm. A trial not completed"
        f" counts with the limit of {protocol.limit_s:g} s. Effect: the ratio of geometric means.",
        Kind.PLAIN: "A distance or speed is compared by a mixed linear model. Effect: the difference of means.",
        Kind.ANSWER: "Answers are compared by a paired t test, as each participant gives one for each condition.",
    }
    fixed = (
        "Fixed effects are condition, delay and scene, in the rows of a contrast’s two conditions alone.",
        "Estimating equations have an exchangeable correlation within participants; Mancl’s and DeRouen’s covariance.",
        "Mixed models have an intercept and a slope of the condition for each participant; without convergence the"
        " intercept alone.",
        "All are judged by Student’s t with one degree of freedom less than participants.",
        "Where all participants differ alike, there is no interval, and the exact test takes the place of the model.",
    )
    rest = (
        "Pairs are trials of a participant with the same delay, scene and repetition, which share their seed.",
        "Intervals of effects are bootstrap percentiles over participants, widened as these are few (Hesterberg 2015).",
        "Beside each model stands the exact test by changes of sign of the participants’ differences; for more than 16"
        " participants the changes are drawn.",
        "Holm’s correction is made among the contrasts of a family; the level is 5 %, two-sided.",
    )
    return (*(told[kind] for kind in Kind if kind in kinds), *fixed, *rest)
