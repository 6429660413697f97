"""Models against closed forms: in balanced data these are known."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t, ttest_rel

from feelahead.study.report.models import fit
from feelahead.study.report.outcomes import Kind

PEOPLE = 10


def balanced(values: Any, delays: int = 1, repeats: int = 6) -> Any:
    """Return rows of conditions a and b; values: (participants, conditions, delays, repeats)."""
    index = pd.MultiIndex.from_product(
        [range(PEOPLE), ["a", "b"], 100.0 * np.arange(delays), range(repeats)],
        names=["participant", "condition", "delay_ms", "repeat"],
    )
    return pd.DataFrame({"value": np.ravel(values)}, index=index).reset_index().assign(scene="wall")


def hits(seed: int = 0, chances: tuple[float, float] = (0.6, 0.2)) -> Any:
    generator = np.random.default_rng(seed)
    return (generator.random((PEOPLE, 2, 1, 6)) < np.array(chances)[None, :, None, None]).astype(float)


def test_the_logistic_model_gives_the_tables_odds_ratio() -> None:
    values = hits()
    first, second = values[:, 0].mean(), values[:, 1].mean()
    found = fit(balanced(values), Kind.SHARE, "a")
    assert (found.model, found.measure, found.note) == ("logistic GEE", "odds ratio", "")
    assert found.estimate == pytest.approx(first / (1 - first) / (second / (1 - second)), rel=1e-5)
    assert fit(balanced(values), Kind.SHARE, "b").estimate == pytest.approx(1.0 / (found.estimate or 0.0), rel=1e-5)


def test_the_log_linear_model_gives_the_ratio_of_means() -> None:
    values = np.random.default_rng(1).poisson(np.array([2.0, 0.5])[None, :, None, None], (PEOPLE, 2, 1, 6))
    found = fit(balanced(values), Kind.AMOUNT, "a")
    assert found.model == "log-linear GEE"
    assert found.estimate == pytest.approx(values[:, 0].mean() / values[:, 1].mean(), rel=1e-5)


@pytest.mark.parametrize("kind", [Kind.SHARE, Kind.AMOUNT])
def test_without_hits_in_a_condition_the_difference_stays(kind: Kind) -> None:
    values = hits(chances=(0.5, 0.0))
    differences = (values[:, 0] - values[:, 1]).mean(axis=(1, 2))
    found = fit(balanced(values), kind, "a")
    assert (found.model, found.measure) == ("linear GEE", "difference")
    assert "no solution" in found.note
    assert found.estimate == pytest.approx(differences.mean())
    # Mancl's and DeRouen's covariance of equal clusters is the paired one times N / (N - 1).
    error = differences.std(ddof=1) / np.sqrt(PEOPLE) * np.sqrt(PEOPLE / (PEOPLE - 1))
    assert found.p == pytest.approx(2.0 * t.sf(differences.mean() / error, PEOPLE - 1), rel=1e-4)
    assert found.low == pytest.approx(differences.mean() - t.ppf(0.975, PEOPLE - 1) * error, rel=1e-4)


def test_the_mixed_model_with_slopes_is_the_paired_t_of_means() -> None:
    generator = np.random.default_rng(4)
    person = generator.normal(0.0, 0.3, (PEOPLE, 1, 1, 1)) + generator.normal(0.0, 0.3, (PEOPLE, 2, 1, 1))
    values = np.exp(
        2.0 + person + np.array([0.0, 0.2])[None, :, None, None] + generator.normal(0, 0.2, (PEOPLE, 2, 3, 4))
    )
    means = np.log(values).mean(axis=(2, 3))
    found = fit(balanced(values, 3, 4), Kind.FACTOR, "b")
    assert found.model == "mixed model of the logarithm, intercepts and slopes by participant"
    assert found.estimate == pytest.approx(np.exp(np.mean(means[:, 1] - means[:, 0])), rel=1e-5)
    assert found.p == pytest.approx(ttest_rel(means[:, 1], means[:, 0]).pvalue, rel=0.02)


def test_without_convergence_slopes_are_left_out_and_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from statsmodels.regression.mixed_linear_model import MixedLM  # noqa: PLC0415

    whole = MixedLM.fit

    def stubborn(self: Any, **options: Any) -> Any:
        if self.exog_re.shape[1] == 2:
            raise np.linalg.LinAlgError("Singular matrix")
        return whole(self, **options)

    monkeypatch.setattr(MixedLM, "fit", stubborn)
    values = np.random.default_rng(6).normal(5.0, 1.0, (PEOPLE, 2, 1, 6))
    found = fit(balanced(values), Kind.PLAIN, "a")
    assert found.model == "mixed model, intercepts by participant"
    assert found.note == "with slopes of the condition it did not converge"
    assert found.estimate == pytest.approx((values[:, 0] - values[:, 1]).mean())


def test_what_cannot_be_fitted_is_none_and_says_why() -> None:
    equal = fit(balanced(np.zeros((PEOPLE, 2, 1, 6))), Kind.SHARE, "a")
    assert (equal.p, equal.estimate, equal.note) == (1.0, 0.0, "all participants alike")
    rows = balanced(hits())
    few = fit(rows[rows.participant < 2], Kind.SHARE, "a")
    assert (few.p, few.note) == (None, "2 participants; a model needs 3")


@pytest.mark.parametrize("kind", list(Kind))
def test_where_all_participants_differ_alike_there_is_no_interval_and_p_is_exact(kind: Kind) -> None:
    values = np.ones((PEOPLE, 2, 1, 6))
    values[:, 1, 0, :3] = 1.0 / math.e if kind is Kind.FACTOR else 0.0
    values[::2] = values[::2, :, :, ::-1]  # not the same trials
    found = fit(balanced(values), kind, "a")
    assert found.estimate == pytest.approx(np.exp(0.5) if kind is Kind.FACTOR else 0.5)
    assert (found.low, found.high, found.p, found.note) == (None, None, 2.0 / 2**PEOPLE, "all participants alike")


def test_answers_are_compared_by_the_paired_t() -> None:
    values = np.random.default_rng(8).integers(1, 8, (PEOPLE, 2, 1, 1)).astype(float)
    found = fit(balanced(values, 1, 1), Kind.ANSWER, "a")
    assert found.p == pytest.approx(ttest_rel(values[:, 0].ravel(), values[:, 1].ravel()).pvalue)
