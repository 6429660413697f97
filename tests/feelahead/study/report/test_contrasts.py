from dataclasses import replace

import numpy as np
import pytest

from common.errors import ConfigurationError
from feelahead.study.protocol import Contrast
from feelahead.study.questionnaires import NASA_TLX
from feelahead.study.report.contrasts import compare, effects_by, holm, pairs_of
from feelahead.study.report.outcomes import Kind, Tables, measured, outcome_of
from tests.feelahead.study.made_up import PROTOCOL, made_up


def asking(tables: Tables, *contrasts: Contrast) -> Tables:
    return replace(tables, protocol=replace(tables.protocol, contrasts=contrasts))


def test_holms_correction_by_hand() -> None:
    tests = [("a", 0.01), ("b", 0.04), ("a", 0.04), ("a", 0.03)]
    assert holm(tests) == pytest.approx((0.03, 0.04, 0.06, 0.06))
    known, unknown = holm([("a", 0.02), ("a", None)])
    assert known == pytest.approx(0.04)
    assert unknown is None


def test_a_contrast_finds_what_was_put_in() -> None:
    hit, time, margin = compare(made_up())
    assert hit.effect.participants == 12
    assert hit.effect.pairs == 12 * 18
    assert hit.effect.effect == pytest.approx((hit.effect.value_first or 0) - (hit.effect.value_second or 0))
    assert (hit.effect.low or 0.0) > 0.3
    assert (time.effect.measure, time.fit.measure) == ("ratio", "ratio")
    assert time.effect.effect == pytest.approx(time.fit.estimate, rel=1e-3)
    assert (time.effect.high or 2.0) < 1.0
    for one in (hit, margin):
        assert one.p_holm is not None
        assert one.fit.p is not None
        assert one.fit.p < one.p_holm < 0.05


def test_only_complete_pairs_count() -> None:
    tables = made_up()
    trials = tables.trials
    trials.loc[trials.index[trials.condition == "off"][0], "status"] = "fault"
    trials.loc[trials.index[trials.condition == "swept"][5], "excluded"] = "somebody came in"
    trials.loc[(trials.participant == 7) & (trials.condition == "swept"), "practice"] = True
    [hit, *_] = compare(tables)
    assert (hit.effect.participants, hit.effect.pairs) == (11, 11 * 18 - 2)


def test_a_trial_that_was_not_completed_counts_with_the_limit() -> None:
    tables = made_up()
    tables.trials.loc[3, ["completed", "time_s"]] = [False, np.nan]
    assert measured(tables, outcome_of("time_s")).value[3] == PROTOCOL.limit_s
    tables.trials.loc[4, "path_m"] = 0.0
    assert len(measured(tables, outcome_of("path_m"))) == len(tables.trials) - 1


def test_the_raw_score_is_the_mean_of_six_items_and_none_of_five() -> None:
    tables = asking(made_up(), Contrast("tlx", "off", "swept"), Contrast("I felt in control", "off", "swept"))
    answers = tables.answers
    own = answers[(answers.participant == 2) & (answers.condition == "off") & answers["item"].str.startswith("tlx")]
    values = measured(tables, outcome_of("tlx"))
    assert values[(values.participant == 2) & (values.condition == "off")].value.item() == pytest.approx(
        own.value.mean()
    )
    missing = answers.drop(index=own.index[own["item"] == NASA_TLX[0].name])
    tlx, control = compare(replace(tables, answers=missing))
    assert (tlx.effect.participants, control.effect.participants) == (11, 12)
    assert tlx.fit.model == "paired t"


def test_effects_by_delay_add_up_to_the_whole() -> None:
    tables = asking(made_up(), Contrast("hit", "off", "swept"))
    [whole] = compare(tables)
    parts = [effect.effect or 0.0 for _, _, effect in effects_by(tables, "delay_ms")]
    assert len(parts) == 3
    assert np.mean(parts) == pytest.approx(whole.effect.effect)


def test_without_a_pair_nothing_is_said() -> None:
    tables = made_up()
    [first, *_] = compare(replace(tables, trials=tables.trials[tables.trials.condition != "off"]))
    assert (first.effect.participants, first.effect.effect, first.fit.p, first.p_holm, first.p_exact) == (
        0,
        *[None] * 4,
    )
    assert pairs_of(measured(tables, outcome_of("hit")), Kind.SHARE, "off", "nothing").participants == ()


def test_a_table_without_a_column_is_refused_with_its_name() -> None:
    tables = made_up(people=1)
    with pytest.raises(ConfigurationError, match="trials: no column impulse_n_s; valid: hit, completed"):
        Tables(PROTOCOL, tables.trials.drop(columns="impulse_n_s"), tables.answers)
