"""Stiffness to effect and level: nearest, growing, and without chatter."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.dualsense.effects.official import MultiPositionFeedback, Off
from operator_side.feel.bands import BandSettings
from operator_side.feel.level import LevelSelector, stiffness_to_effect

REPEATABLE = settings(derandomize=True, deadline=None)
STIFFNESS = st.floats(0.0, 1.0)


def test_the_ends() -> None:
    assert stiffness_to_effect(0.0) == Off()
    assert stiffness_to_effect(0.006) == Off()
    assert stiffness_to_effect(1.0) == MultiPositionFeedback((8,) * 10)
    assert stiffness_to_effect(0.5) == MultiPositionFeedback((4,) * 10)


def test_every_level_is_its_own_profile() -> None:
    assert [sum(stiffness_to_effect(level / 80).zone_strengths) for level in range(81)] == list(range(81))


@given(STIFFNESS, STIFFNESS)
@REPEATABLE
def test_no_zone_falls_as_stiffness_grows(one: float, other: float) -> None:
    soft, stiff = (stiffness_to_effect(s).zone_strengths for s in sorted((one, other)))
    assert all(a <= b for a, b in zip(soft, stiff, strict=True))


@given(STIFFNESS)
@REPEATABLE
def test_the_level_is_the_nearest(stiffness: float) -> None:
    assert abs(sum(stiffness_to_effect(stiffness).zone_strengths) - 80 * stiffness) <= 0.5


@pytest.mark.parametrize("stiffness", [-0.01, 1.01, math.nan, math.inf, -math.inf])
def test_out_of_range(stiffness: float) -> None:
    with pytest.raises(ValueError, match="stiffness"):
        stiffness_to_effect(stiffness)
    selector = LevelSelector()
    selector.select(0.5)
    with pytest.raises(ValueError, match="stiffness"):
        selector.select(stiffness)
    assert selector.level == 40


@pytest.mark.parametrize("margin", [-0.1, 0.5, math.nan])
def test_margin_out_of_range(margin: float) -> None:
    with pytest.raises(ValueError, match="margin"):
        LevelSelector(margin=margin)


@given(st.lists(STIFFNESS, min_size=1, max_size=50), st.floats(0.0, 0.49))
@REPEATABLE
def test_the_selected_level_stays_within_the_threshold(values: list[float], margin: float) -> None:
    selector = LevelSelector(margin=margin)
    for stiffness in values:
        level = selector.select(stiffness)
        assert level == selector.level
        assert abs(level - 80 * stiffness) <= 0.5 + margin
        if stiffness == 0.0:
            assert level == 0
        if stiffness == 1.0:
            assert level == 80


@given(st.integers(0, 79), st.integers(0, 2**32 - 1))
@REPEATABLE
def test_noise_at_half_a_level_does_not_chatter(level: int, seed: int) -> None:
    noise = np.random.default_rng(seed).uniform(-0.2, 0.2, 200)
    selector = LevelSelector(margin=0.25)
    chosen = [selector.select((level + 0.5 + float(n)) / 80) for n in noise]
    # The first value moves it from 0; after that it never moves again.
    assert len(set(chosen)) == 1
    assert len({stiffness_to_effect((level + 0.5 + float(n)) / 80) for n in noise}) == 2


@given(st.sampled_from([BandSettings(), BandSettings(marked=False)]), st.lists(STIFFNESS), STIFFNESS, STIFFNESS)
@REPEATABLE
def test_after_any_past_more_stiffness_is_never_a_lower_level(
    bands: BandSettings, past: list[float], one: float, other: float
) -> None:
    chosen = []
    for last in sorted((one, other)):
        selector = LevelSelector(bands)
        for stiffness in past:
            selector.select(stiffness)
        chosen.append(selector.select(last))
    assert chosen[0] <= chosen[1]


@given(STIFFNESS)
@REPEATABLE
def test_zero_is_off_from_any_level(stiffness: float) -> None:
    selector = LevelSelector(BandSettings())
    selector.select(stiffness)
    assert selector.select(0.0) == 0
