import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.timing.difference_blocks import MOST_BLOCKS, Block, BlockTrack

samples = st.lists(st.tuples(st.floats(0.0, 0.1), st.floats(-0.5, 0.5)), min_size=1, max_size=60)


def block_of(pairs: list[tuple[float, float]], unfair: list[tuple[float, float]] | None = None) -> Block:
    track = BlockTrack()
    for at_s, value_s in pairs:
        track.add(at_s, value_s)
    for at_s, value_s in unfair or []:
        track.add(at_s, value_s, fair=False)
    block = track.close()
    assert block is not None
    return block


def agrees(block: Block, pairs: list[tuple[float, float]]) -> None:
    times_s, values_s = np.array(pairs).T
    deviations_s = values_s - values_s.mean()
    assert block.count == len(pairs)
    assert block.least_s == values_s.min()
    assert (block.least_at_s, block.least_s) in pairs
    assert block.mean_at_s == pytest.approx(times_s.mean(), abs=1e-12)
    assert block.mean_s == pytest.approx(values_s.mean(), abs=1e-12)
    assert block.squares_s2 == pytest.approx((deviations_s**2).sum(), abs=1e-12)
    assert block.cubes_s3 == pytest.approx((deviations_s**3).sum(), abs=1e-12)


@given(samples)
def test_a_block_has_the_moments_of_its_samples(pairs: list[tuple[float, float]]) -> None:
    agrees(block_of(pairs), pairs)


@given(samples, samples)
def test_merged_blocks_are_the_block_of_all(early: list[tuple[float, float]], late: list[tuple[float, float]]) -> None:
    agrees(block_of(early).merged(block_of(late)), early + late)


def test_samples_chosen_for_being_early_count_for_the_least_alone() -> None:
    block = block_of([(0.01, 0.30), (0.02, 0.10)], unfair=[(0.03, 0.05), (0.04, 0.20)])
    assert (block.least_s, block.least_at_s) == (0.05, 0.03)
    assert block.count == 2
    assert block.mean_s == pytest.approx(0.20)


@pytest.mark.parametrize(("shape", "expected"), [("normal", 0.0), ("exponential", 2.0), ("uniform", 0.0)])
def test_skewness_tells_shapes_apart(shape: str, expected: float) -> None:
    generator = np.random.default_rng(4)
    draws = {
        "normal": generator.normal(0.05, 0.01, 20_000),
        "exponential": 0.05 + generator.exponential(0.01, 20_000),
        "uniform": generator.uniform(0.04, 0.06, 20_000),
    }
    assert block_of([(0.0, float(value)) for value in draws[shape]]).skewness == pytest.approx(expected, abs=0.1)


def test_a_few_or_equal_samples_have_no_shape() -> None:
    assert block_of([(0.0, 0.1 * k) for k in range(7)]).skewness is None
    assert block_of([(0.0, 0.1 * k) for k in range(8)]).skewness is not None
    assert block_of([(0.0, 0.1)] * 100).skewness is None
    assert block_of([(0.0, 0.1 + 20e-6 * (k % 7)) for k in range(100)]).skewness is None


def test_a_track_keeps_what_is_new_and_no_more_than_its_number() -> None:
    track = BlockTrack()
    for second in range(200):
        track.add(float(second), 0.0)
        block = track.close()
        assert block is not None
        track.keep(block, oldest_s=float(second - 1000))
    assert [block.least_at_s for block in track.blocks] == [float(second) for second in range(200 - MOST_BLOCKS, 200)]
    track.add(500.0, 0.0)
    block = track.close()
    assert block is not None
    track.keep(block, oldest_s=198.0)
    assert [block.least_at_s for block in track.blocks] == [198.0, 199.0, 500.0]
