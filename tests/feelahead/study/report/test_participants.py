from itertools import product

import numpy as np
import pytest
from scipy.stats import nct, ttest_1samp, ttest_rel

from feelahead.study.report.participants import cohens_d_z, mean_interval, paired_t, share_interval, sign_change_p


def test_the_exact_test_counts_every_change_of_sign() -> None:
    counts = np.array([3.0, 1.0, 0.0, 4.0, -1.0, 2.0, 5.0, -2.0])
    sums = [
        abs(sum(sign * one for sign, one in zip(signs, counts, strict=True))) for signs in product((-1, 1), repeat=8)
    ]
    expected = np.mean(np.array(sums) >= abs(counts.sum()))
    assert sign_change_p(counts, seed=0) == pytest.approx(expected)
    assert sign_change_p(np.full(6, 2.0), seed=0) == pytest.approx(2.0 / 2**6)


@pytest.mark.parametrize("values", [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
def test_the_exact_test_finds_nothing_in_one_difference(values: list[float]) -> None:
    assert sign_change_p(np.array(values), seed=0) == 1.0


def test_of_many_participants_signs_are_drawn_by_the_seed() -> None:
    values = np.random.default_rng(3).normal(0.4, 1.0, 30)
    assert sign_change_p(values, seed=1) == sign_change_p(values, seed=1)
    assert sign_change_p(values, seed=1) == pytest.approx(ttest_1samp(values, 0.0).pvalue, abs=0.01)


def test_the_bootstraps_interval_is_as_wide_as_students_where_that_is_right() -> None:
    values = np.random.default_rng(5).normal(1.0, 2.0, 12)
    student = ttest_1samp(values, 0.0).confidence_interval(0.95)
    low, high = mean_interval(values, seed=2) or (0.0, 0.0)
    # Without the widening, 0.84 times.
    assert (high - low) / (student.high - student.low) == pytest.approx(1.0, abs=0.06)
    assert mean_interval(values, seed=2) == (low, high)
    assert mean_interval(values[:2], seed=0) is None


def test_nobody_with_a_hit_leaves_what_the_exact_interval_leaves() -> None:
    low, high = share_interval(np.zeros(12), seed=0) or (1.0, 1.0)
    assert (low, high) == pytest.approx((0.0, 1.0 - 0.025 ** (1 / 12)))
    assert share_interval(np.ones(12), seed=0) == pytest.approx((0.025 ** (1 / 12), 1.0))
    low, high = share_interval(np.array([0.0, 0.0, 0.0, 0.9]), seed=0) or (1.0, 0.0)
    assert low == 0.0 < high <= 1.0


def test_d_z_and_its_interval_belong_to_the_noncentral_t() -> None:
    values = np.array([0.3, 0.5, -0.1, 0.4, 0.9, 0.2, 0.0])
    effect, low, high = cohens_d_z(values) or (0.0, 0.0, 0.0)
    assert effect == pytest.approx(values.mean() / values.std(ddof=1))
    at = effect * np.sqrt(7)
    assert nct.cdf(at, 6, np.array([low, high]) * np.sqrt(7)) == pytest.approx([0.975, 0.025], abs=1e-4)
    assert cohens_d_z(np.full(5, 0.2)) is None


def test_the_paired_t_is_scipys() -> None:
    first, second = np.array([3.0, 5.0, 4.0, 8.0]), np.array([2.0, 5.0, 1.0, 6.0])
    found = paired_t(first - second)
    assert found is not None
    assert found[0] == pytest.approx(ttest_rel(first, second).pvalue)
    assert paired_t(np.ones(2)) is None


def test_without_a_spread_between_participants_there_is_no_interval() -> None:
    values = np.array([3.0, 3.0, 2.0, 2.0]) / 6.0 - np.array([2.0, 2.0, 1.0, 1.0]) / 6.0
    assert np.ptp(values) > 0.0  # by rounding
    assert mean_interval(values, seed=0) is None
    assert share_interval(values, seed=0) is None
    assert paired_t(values) is None
    assert cohens_d_z(values) is None
    assert sign_change_p(values, seed=0) == 2.0 / 2**4
    assert sign_change_p(np.full(40, 0.1), seed=0) == 2.0 / 2**40
