"""Stiffness to effect: 81 profiles that only ever grow, and a selector that does not chatter."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.dualsense.effects import MultiPositionFeedback, Off
from operator_side.trigger_effect import EffectSelector, stiffness_to_effect

REPEATABLE = settings(derandomize=True, deadline=None)
STIFFNESS = st.floats(0.0, 1.0)
LEVELS = [stiffness_to_effect(level / 80) for level in range(81)]


def test_the_ends() -> None:
    assert stiffness_to_effect(0.0) == Off()
    assert stiffness_to_effect(0.006) == Off()
    assert stiffness_to_effect(1.0) == MultiPositionFeedback((8,) * 10)
    assert stiffness_to_effect(0.5) == MultiPositionFeedback((4,) * 10)


def test_every_level_is_its_own_profile() -> None:
    assert [sum(effect.zone_strengths) for effect in LEVELS] == list(range(81))


def test_every_level_adds_to_exactly_one_zone() -> None:
    for lower, higher in itertools.pairwise(LEVELS):
        gained = [b - a for a, b in zip(lower.zone_strengths, higher.zone_strengths, strict=True)]
        assert sorted(gained) == [0] * 9 + [1]


def test_sensed_zones_fill_first_and_without_a_step_down() -> None:
    for effect in LEVELS:
        sensed, beyond = effect.zone_strengths[:8], effect.zone_strengths[8:]
        assert list(sensed) == sorted(sensed)
        assert sensed[-1] - sensed[0] <= 1
        # Zone 8 has caught up with the start only once every sensed zone has had its turn; zone 9 is last.
        assert sensed[0] >= beyond[0] >= beyond[1]


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
    selector = EffectSelector()
    selector.select(0.5)
    with pytest.raises(ValueError, match="stiffness"):
        selector.select(stiffness)
    assert selector.level == 40


@pytest.mark.parametrize("margin", [-0.1, 0.5, math.nan])
def test_margin_out_of_range(margin: float) -> None:
    with pytest.raises(ValueError, match="margin"):
        EffectSelector(margin)


@given(st.lists(STIFFNESS, min_size=1, max_size=50), st.floats(0.0, 0.49))
@REPEATABLE
def test_the_selected_level_stays_within_the_threshold(values: list[float], margin: float) -> None:
    selector = EffectSelector(margin)
    for stiffness in values:
        effect = selector.select(stiffness)
        assert effect == LEVELS[selector.level]
        assert abs(selector.level - 80 * stiffness) <= 0.5 + margin
        if stiffness == 0.0:
            assert effect == Off()
        if stiffness == 1.0:
            assert selector.level == 80


@given(st.integers(0, 79), st.integers(0, 2**32 - 1))
@REPEATABLE
def test_noise_at_half_a_level_does_not_chatter(level: int, seed: int) -> None:
    noise = np.random.default_rng(seed).uniform(-0.2, 0.2, 200)
    selector = EffectSelector(margin=0.25)
    chosen = [selector.select((level + 0.5 + float(n)) / 80) for n in noise]
    # The first value moves it from 0; after that it never moves again.
    assert len(set(chosen)) == 1
    assert len({stiffness_to_effect((level + 0.5 + float(n)) / 80) for n in noise}) == 2


@given(STIFFNESS)
@REPEATABLE
def test_zero_is_off_from_any_level(stiffness: float) -> None:
    selector = EffectSelector()
    selector.select(stiffness)
    assert selector.select(0.0) == Off()
