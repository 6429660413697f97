"""One zone stiffer where contact is predicted."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.dualsense.effects.official import MultiPositionFeedback, Off
from operator_side.feel.contact_detent import DetentSelector, with_detent
from operator_side.feel.force_profiles import force_profiles

REPEATABLE = settings(derandomize=True, deadline=None)
EFFECTS = force_profiles().effects


@pytest.mark.parametrize(("travel", "zone"), [(0.0, 0), (0.05, 0), (0.31, 3), (0.79, 7), (1.0, 9)])
def test_the_zone_that_the_travel_lies_in(travel: float, zone: int) -> None:
    assert DetentSelector().select(travel) == zone


def test_no_contact_is_no_zone() -> None:
    selector = DetentSelector()
    selector.select(0.5)
    assert selector.select(None) is None


@given(st.integers(1, 9), st.integers(0, 2**32 - 1))
@REPEATABLE
def test_noise_at_a_border_does_not_move_it(border: int, seed: int) -> None:
    selector = DetentSelector()
    noise = np.random.default_rng(seed).uniform(-0.019, 0.019, 200)
    assert len({selector.select(border / 10 + float(n)) for n in noise}) == 1


def test_it_moves_on_with_contact() -> None:
    selector = DetentSelector()
    assert [selector.select(travel) for travel in (0.55, 0.49, 0.47, 0.2, 0.0)] == [5, 5, 4, 2, 0]


def test_one_zone_is_two_strengths_stiffer_and_can_be_pushed_through() -> None:
    assert with_detent(Off(), 3) == MultiPositionFeedback((0, 0, 0, 2, 0, 0, 0, 0, 0, 0))
    assert with_detent(MultiPositionFeedback((7,) * 10), 9) == MultiPositionFeedback((7,) * 9 + (8,))
    assert with_detent(EFFECTS[37], None) == EFFECTS[37]


@given(st.integers(0, 80), st.integers(0, 80), st.integers(0, 9))
@REPEATABLE
def test_with_the_bump_too_no_zone_falls_as_the_level_grows(one: int, other: int, zone: int) -> None:
    soft, stiff = (with_detent(EFFECTS[level], zone).zone_strengths for level in sorted((one, other)))
    assert all(a <= b for a, b in zip(soft, stiff, strict=True))
    assert all(a >= b for a, b in zip(soft, EFFECTS[min(one, other)].zone_strengths, strict=True))


@pytest.mark.parametrize("travel", [-0.01, 1.01, math.nan])
def test_what_is_no_travel(travel: float) -> None:
    with pytest.raises(ValueError, match="mechanical_travel"):
        DetentSelector().select(travel)
