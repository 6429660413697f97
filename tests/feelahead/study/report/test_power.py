from dataclasses import replace

import pytest
from statsmodels.stats.power import TTestPower

from common.errors import ConfigurationError
from feelahead.study.protocol import Contrast
from feelahead.study.report.contrasts import compare
from feelahead.study.report.outcomes import Tables
from feelahead.study.report.power import balanced_sizes, plan
from feelahead.study.report.preregistration import preregistration
from feelahead.study.report.words import sentence
from tests.feelahead.study.made_up import PROTOCOL, made_up

TIME = Contrast("time_s", "off", "swept")


@pytest.fixture(scope="module")
def pool() -> Tables:
    return made_up(people=80, seed=5)


def asking(tables: Tables, *contrasts: Contrast) -> Tables:
    return replace(tables, protocol=replace(tables.protocol, contrasts=contrasts))


def test_power_is_that_of_the_paired_t_with_the_pools_effect(pool: Tables) -> None:
    [found] = compare(asking(pool, TIME))
    assert found.d_z is not None
    planned = plan(asking(pool, TIME), (12, 20), effects=(1.0, 0.0))
    for row in planned.rows:
        # A pool's spread is known with N, not N - 1.
        expected = TTestPower().power(abs(row.effect * found.d_z[0]) * (80 / 79) ** 0.5, row.participants, 0.05)
        assert row.power == pytest.approx(expected, abs=0.04)
        assert row.low <= row.power <= row.high


def test_a_test_more_in_the_family_takes_power(pool: Tables) -> None:
    [alone] = plan(asking(pool, TIME), (12,), effects=(1.0,)).rows
    both = plan(asking(pool, TIME, Contrast("path_m", "off", "swept")), (12,), effects=(1.0,))
    apart = plan(asking(pool, TIME, Contrast("path_m", "off", "swept", "other")), (12,), effects=(1.0,))
    assert both.rows[0].power < alone.power
    assert apart.rows[0].power == alone.power
    untold = plan(asking(replace(pool, answers=pool.answers.iloc[:0]), TIME, Contrast("tlx", "off", "swept")), (12,))
    assert [one.outcome for one in untold.untold] == ["tlx"]
    assert untold.rows[0].power < alone.power


def test_alike_differences_count_as_in_the_exact_test(pool: Tables) -> None:
    pool = asking(replace(pool, trials=pool.trials.copy()), Contrast("hit", "off", "swept"))
    pool.trials["hit"] = pool.trials.condition == "off"
    assert [row.power for row in plan(pool, (4, 6, 8), effects=(1.0,)).rows] == [0.0, 1.0, 1.0]
    [found] = compare(pool)
    assert (found.effect.effect, found.effect.low, found.fit.p) == (1.0, None, found.p_exact)
    assert "difference 100 points – (all participants alike)" in sentence(found)


def test_the_smallest_number_is_one_from_which_power_stays(pool: Tables) -> None:
    planned = plan(pool)
    for contrast in PROTOCOL.contrasts:
        rows = {row.participants: row for row in planned.rows if row.contrast == contrast and row.effect == 1.0}
        assert tuple(rows) == balanced_sizes(PROTOCOL)
        smallest = planned.smallest(contrast, 0.8)
        assert smallest is not None
        assert all(row.low >= 0.8 for number, row in rows.items() if number >= smallest)
        assert smallest == 4 or rows[smallest - 4].low < 0.8
        assert (planned.smallest(contrast, 0.9) or 99) >= smallest
    assert planned == plan(pool)


def test_sizes_keep_the_order_balanced() -> None:
    assert balanced_sizes(PROTOCOL)[:3] == (4, 8, 12)
    three = replace(PROTOCOL, conditions={name: PROTOCOL.conditions[name] for name in ("off", "swept", "margin")})
    assert balanced_sizes(three)[:2] == (6, 12)


def test_a_plan_without_contrasts_or_participants_is_refused(pool: Tables) -> None:
    with pytest.raises(ConfigurationError, match="contrasts: none; valid: one or more"):
        plan(asking(pool))
    with pytest.raises(ConfigurationError, match="participants = 2; valid: 3 or more"):
        plan(pool, (2,))
    with pytest.raises(ConfigurationError, match="pool: 2 participants"):
        plan(made_up(people=2))


def test_the_preregistration_says_hypotheses_number_and_analysis(pool: Tables) -> None:
    text = preregistration(PROTOCOL, plan(pool))
    for words in (
        f"Protocol {PROTOCOL.hash}.",
        "1. There is a difference in trials with a hit between off and swept (two-sided; family “all”).",
        "- margin: law margin of 40 mm",
        "participant's tool moved: assist 40.0 mm, margin 40.0 mm, off 40.0 mm, swept 40.0 mm.",
        "So 18 trials a block, 72 a participant, of at most 45 s.",
        "50 % of the simulated effect: 80 %",
        "A share of trials is compared by a logistic model",
        "counts with the limit of 45 s",
    ):
        assert words in text
    assert "the new number is above 12, and larger than theirs by a multiple of 4." in text
    unbalanced = preregistration(replace(PROTOCOL, participants=13))
    assert "balanced for multiples of 4, which this number is not" in unbalanced
    assert "Power was not estimated." in unbalanced
