"""Three bands with a step between them that fingers can tell, and no zone ever weaker for it."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.feel.bands import STEP_LEVELS, Band, BandSelector, BandSettings

REPEATABLE = settings(derandomize=True, deadline=None)
STIFFNESS = st.floats(0.0, 1.0)
USUAL = BandSettings()
SETTINGS = st.builds(
    BandSettings,
    near=st.floats(0.11, 0.4),
    danger=st.floats(0.61, 0.89),
    hysteresis=st.floats(0.0, 0.1),
)


def test_the_bands_begin_where_they_are_said_to() -> None:
    assert [USUAL.band(s) for s in (0.0, 0.2499, 0.25, 0.5999, 0.6, 1.0)] == [
        Band.CLEAR,
        Band.CLEAR,
        Band.NEAR,
        Band.NEAR,
        Band.DANGER,
        Band.DANGER,
    ]


@given(SETTINGS)
@REPEATABLE
def test_a_change_of_band_is_a_step_large_against_a_just_noticeable_difference(bands: BandSettings) -> None:
    for threshold, low, high in ((bands.near, Band.CLEAR, Band.NEAR), (bands.danger, Band.NEAR, Band.DANGER)):
        below, above = bands.exact_level(threshold, low), bands.exact_level(threshold, high)
        assert above - below == pytest.approx(STEP_LEVELS)
        # The largest JND of stiffness is 15 %; a step of more than that, and at the defaults of 40 % and more.
        assert above / below > 1.2
    assert bands.exact_level(0.0, Band.CLEAR) == 0.0
    assert bands.exact_level(1.0, Band.DANGER) == 80.0


def test_the_usual_steps() -> None:
    assert USUAL.exact_level(0.25, Band.NEAR) / USUAL.exact_level(0.25, Band.CLEAR) == pytest.approx(28 / 12)
    assert USUAL.exact_level(0.6, Band.DANGER) / USUAL.exact_level(0.6, Band.NEAR) == pytest.approx(56 / 40)


@given(SETTINGS, STIFFNESS, STIFFNESS, st.sampled_from(Band), st.sampled_from(Band))
@REPEATABLE
def test_the_level_never_falls_as_stiffness_or_band_grow(
    bands: BandSettings, one: float, other: float, a: Band, b: Band
) -> None:
    low, high = sorted((one, other))
    assert bands.exact_level(low, min(a, b)) <= bands.exact_level(high, max(a, b))


@given(STIFFNESS, st.sampled_from(Band))
@REPEATABLE
def test_without_marks_the_level_is_80_times_the_stiffness(stiffness: float, band: Band) -> None:
    assert BandSettings(marked=False).exact_level(stiffness, band) == 80 * stiffness


@given(st.lists(STIFFNESS, min_size=1), STIFFNESS, STIFFNESS)
@REPEATABLE
def test_after_any_past_more_stiffness_is_never_a_lower_band(past: list[float], one: float, other: float) -> None:
    chosen = []
    for last in sorted((one, other)):
        selector = BandSelector(USUAL)
        for stiffness in past:
            selector.select(stiffness)
        chosen.append(selector.select(last))
    assert chosen[0] <= chosen[1]


@given(st.sampled_from([0.25, 0.6]), st.integers(0, 2**32 - 1))
@REPEATABLE
def test_noise_at_a_threshold_is_one_step(threshold: float, seed: int) -> None:
    selector = BandSelector(USUAL)
    noise = np.random.default_rng(seed).uniform(-0.019, 0.019, 500)
    bands = [selector.select(threshold + float(n)) for n in noise]
    assert sum(a is not b for a, b in itertools.pairwise(bands)) <= 1


def test_a_band_is_left_downwards_by_its_hysteresis() -> None:
    selector = BandSelector(USUAL)
    assert selector.select(0.7) is Band.DANGER
    assert selector.select(0.57) is Band.DANGER
    assert selector.select(0.55) is Band.NEAR
    assert selector.select(0.7) is Band.DANGER
    assert selector.select(0.22) is Band.NEAR
    assert selector.select(0.0) is Band.CLEAR


@pytest.mark.parametrize("stiffness", [-0.01, 1.01, math.nan, math.inf])
def test_what_is_no_stiffness_changes_nothing(stiffness: float) -> None:
    selector = BandSelector(USUAL)
    selector.select(0.7)
    with pytest.raises(ValueError, match="stiffness"):
        selector.select(stiffness)
    assert selector.band is Band.DANGER


@pytest.mark.parametrize(
    "fields",
    [
        {"near": 0.1},
        {"near": 0.45},
        {"danger": 0.9},
        {"danger": 0.3},
        {"near": math.nan},
        {"danger": math.nan},
        {"hysteresis": -0.01},
        {"hysteresis": 0.11},
        {"hysteresis": math.nan},
    ],
)
def test_impossible_bands(fields: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="valid"):
        BandSettings(**fields)
