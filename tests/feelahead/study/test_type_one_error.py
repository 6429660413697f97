"""The quick version; the whole one: python -m tests.feelahead.study.type_one_error."""

import pytest
from scipy.stats import binom

from feelahead.study.report.power import LEVEL
from tests.feelahead.study.made_up import NONE, made_up
from tests.feelahead.study.type_one_error import ASKED, MODERATE, compared, errors

pytestmark = pytest.mark.long

STUDIES = 40
MOST = int(binom.ppf(0.999, STUDIES, LEVEL))


def test_without_an_effect_the_tests_find_one_as_seldom_as_they_say() -> None:
    pool = made_up(NONE, ASKED, 40, seed=1)
    for one in errors([*compared(pool, 12, STUDIES, 0, without_effect=True)]):
        assert max(one.model, one.exact, one.interval) <= MOST, one


def test_with_an_effect_they_find_it_in_most_studies() -> None:
    pool = made_up(MODERATE, ASKED, 40, seed=1)
    for one in errors([*compared(pool, 20, 10, 0, without_effect=False)]):
        assert one.model >= 5, one
