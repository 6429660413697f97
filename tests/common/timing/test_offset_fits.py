import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.timing.difference_blocks import Block, BlockTrack
from common.timing.offset_fits import TYPICAL_SKEW, Average, fit_envelope, fit_mean, typical_skewness

MAX_SKEW = 600e-6


def blocks_of(times_s: np.ndarray, values_s: np.ndarray, length_s: float = 0.1) -> list[Block]:
    blocks = []
    for _, members in itertools.groupby(zip(times_s, values_s, strict=True), key=lambda pair: int(pair[0] / length_s)):
        track = BlockTrack()
        for at_s, value_s in members:
            track.add(float(at_s), float(value_s))
        block = track.close()
        assert block is not None
        blocks.append(block)
    return blocks


def both_ways(there_s: np.ndarray, back_s: np.ndarray, offset_s: float, skew: float) -> tuple[list[Block], list[Block]]:
    """Return blocks of time differences, to the peer and from the peer, for messages 4 ms apart with these delays."""
    times_s = 0.004 * np.arange(there_s.size)
    drifted_s = offset_s + skew * times_s
    return blocks_of(times_s, there_s + drifted_s), blocks_of(times_s, back_s - drifted_s)


points = st.lists(st.tuples(st.floats(0.0, 60.0), st.floats(0.0, 0.1)), min_size=1, max_size=40)


@given(points, points, st.floats(-MAX_SKEW, MAX_SKEW))
def test_the_envelope_lies_under_everything_and_touches_it(
    there: list[tuple[float, float]], back: list[tuple[float, float]], guess: float
) -> None:
    to_peer, from_peer = ([blocks_of(np.array([at_s]), np.array([s]))[0] for at_s, s in way] for way in (there, back))
    envelope = fit_envelope(to_peer, from_peer, MAX_SKEW, guess)
    assert -MAX_SKEW <= envelope.line.skew <= MAX_SKEW
    assert envelope.to_peer.slope == -envelope.from_peer.slope == envelope.line.skew
    for floor, blocks in ((envelope.to_peer, to_peer), (envelope.from_peer, from_peer)):
        assert min(floor.excess(block) for block in blocks) == pytest.approx(0.0, abs=1e-12)
    half_s = (envelope.to_peer.difference_s - envelope.from_peer.difference_s) / 2.0
    assert envelope.line.value(0.0) == pytest.approx(half_s, abs=1e-12)


def test_a_moment_of_noise_says_nothing_about_the_skew() -> None:
    generator = np.random.default_rng(6)
    there_s, back_s = generator.normal(0.05, 0.01, (2, 50))
    to_peer, from_peer = both_ways(there_s, back_s, 0.0, 0.0)
    # Without the prior the slope of 0.2 s of such noise would be thousands of parts in a million.
    assert abs(fit_mean(Average(to_peer), Average(from_peer), MAX_SKEW).skew) < TYPICAL_SKEW / 10.0
    assert abs(fit_envelope(to_peer, from_peer, MAX_SKEW, 0.0).line.skew) < TYPICAL_SKEW


@pytest.mark.parametrize("seed", range(5))
def test_the_mean_is_least_squares_where_data_outweigh_the_prior(seed: int) -> None:
    generator = np.random.default_rng(seed)
    there_s, back_s = generator.normal(0.05, 0.001, (2, 15_000))
    to_peer, from_peer = both_ways(there_s, back_s, 0.3, 100e-6)
    times_s = 0.004 * np.arange(15_000)
    slope, level_s = np.polyfit(times_s, (there_s - back_s) / 2.0 + 0.3 + 100e-6 * times_s, 1)
    line = fit_mean(Average(to_peer), Average(from_peer), MAX_SKEW)
    assert line.skew == pytest.approx(slope, abs=0.3e-6)
    assert line.value(60.0) == pytest.approx(level_s + slope * 60.0, abs=20e-6)


def test_the_skewness_of_most_blocks_counts() -> None:
    generator = np.random.default_rng(7)
    times_s, values_s = 0.004 * np.arange(2500), generator.normal(0.05, 0.01, 2500)
    values_s[1000:1030] += 1.0
    skewness = typical_skewness(blocks_of(times_s, values_s), 10)
    assert skewness == pytest.approx(0.0, abs=0.2)
    assert typical_skewness(blocks_of(times_s[:225], values_s[:225]), 10) is None


def test_wander_tells_slow_from_independent_delays() -> None:
    generator = np.random.default_rng(8)
    times_s, values_s = 0.004 * np.arange(5000), generator.normal(0.05, 0.01, 5000)
    assert Average(blocks_of(times_s, values_s)).wander(0.0) == pytest.approx(0.67, abs=0.2)
    slow_s = values_s + 0.03 * np.sin(times_s)
    assert Average(blocks_of(times_s, slow_s)).wander(0.0) > 3.0
