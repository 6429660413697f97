"""Full force does not last: it is lowered slowly, and comes back after a rest."""

import itertools
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.feel.force_profiles import force_profiles
from operator_side.feel.sustained_force import SustainedForceLimit, SustainedForceSettings

REPEATABLE = settings(derandomize=True, deadline=None)
USUAL = SustainedForceSettings()


def held(limit: SustainedForceLimit, level: int, from_s: float, to_s: float, step_s: float = 0.01) -> list[int]:
    steps = round((to_s - from_s) / step_s)
    return [limit.limited(level, from_s + step * step_s) for step in range(steps + 1)]


def test_full_force_lasts_ten_seconds_and_fades_in_five() -> None:
    limit = SustainedForceLimit(USUAL)
    assert set(held(limit, 80, 0.0, 10.0)) == {80}
    fading = held(limit, 80, 10.0, 15.0)
    assert fading == sorted(fading, reverse=True)
    assert max(a - b for a, b in itertools.pairwise(fading)) == 1
    assert set(held(limit, 80, 15.0, 100.0)) == {50}


def test_below_full_force_nothing_is_ever_lowered() -> None:
    # Level 50 has strength 5 throughout; 51 has strength 6 where a full pull rests.
    assert set(held(SustainedForceLimit(USUAL), 50, 0.0, 100.0, 0.1)) == {50}
    assert held(SustainedForceLimit(USUAL), 51, 0.0, 100.0, 0.1)[-1] == 50


@pytest.mark.parametrize("reachable_zones", range(1, 11))
@pytest.mark.parametrize(("full", "sustainable"), [(6, 5), (8, 1), (3, 2)])
def test_full_is_the_first_level_that_is_felt_as_such_and_sustainable_the_last(
    reachable_zones: int, full: int, sustainable: int
) -> None:
    felt = [max(force_profiles(reachable_zones).felt(level)) for level in range(81)]
    settings = SustainedForceSettings(longest_s=0.0, full_strength=full, sustainable_strength=sustainable)
    lasting = [held(SustainedForceLimit(settings), level, 0.0, 10.0, 0.1)[-1] for level in range(81)]
    for level in range(81):
        if felt[level] < full:
            assert lasting[level] == level
        else:
            assert felt[lasting[level]] == sustainable
    assert felt[lasting[80] + 1] > sustainable


def test_it_recovers_as_slowly_as_it_faded() -> None:
    limit = SustainedForceLimit(USUAL)
    held(limit, 80, 0.0, 60.0)
    held(limit, 40, 60.0, 62.5)
    assert limit.highest_level == 65
    held(limit, 40, 62.5, 65.0)
    assert limit.highest_level == 80
    # Not yet rested: the next full force fades at once; after ten seconds more, it is fresh.
    assert held(limit, 80, 65.0, 66.0)[-1] < 80
    limit = SustainedForceLimit(USUAL)
    held(limit, 80, 0.0, 60.0)
    held(limit, 0, 60.0, 75.0)
    assert set(held(limit, 80, 75.0, 84.9)) == {80}


def test_short_calls_and_long_ones_agree() -> None:
    often, rarely = SustainedForceLimit(USUAL), SustainedForceLimit(USUAL)
    assert held(often, 80, 0.0, 13.0)[-1] == held(rarely, 80, 0.0, 13.0, 6.5)[-1]


@given(st.lists(st.tuples(st.integers(0, 80), st.floats(0.0, 20.0))), st.integers(0, 80), st.integers(0, 80))
@REPEATABLE
def test_after_any_past_a_higher_level_is_never_limited_to_a_lower_one(
    past: list[tuple[int, float]], one: int, other: int
) -> None:
    limited = []
    for last in sorted((one, other)):
        limit, now_s = SustainedForceLimit(USUAL), 0.0
        for level, step_s in past:
            assert min(level, 50) <= limit.limited(level, now_s) <= level
            now_s += step_s
        limited.append(limit.limited(last, now_s))
    assert limited[0] <= limited[1]


@pytest.mark.parametrize("now_s", [0.9, math.nan])
def test_time_does_not_run_backwards(now_s: float) -> None:
    limit = SustainedForceLimit(USUAL)
    limit.limited(80, 1.0)
    with pytest.raises(ValueError, match="now_s"):
        limit.limited(80, now_s)


@pytest.mark.parametrize(
    "fields",
    [
        {"longest_s": -1.0},
        {"longest_s": math.nan},
        {"fade_s": 0.0},
        {"full_strength": 5},
        {"full_strength": 9},
        {"sustainable_strength": 0},
    ],
)
def test_impossible_settings(fields: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="valid"):
        SustainedForceSettings(**fields)
