import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.gripper.near_order import near_order
from tests.helpers.gripper_poses import cover_gripper


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=st.integers(0, 1000), count=st.integers(0, 60), size=st.integers(1, 9))
def test_it_is_a_permutation_that_does_not_depend_on_chance(seed: int, count: int, size: int) -> None:
    centers = np.random.default_rng(seed).normal(size=(count, 3))
    order = near_order(centers, size)
    np.testing.assert_array_equal(np.sort(order), np.arange(count))
    np.testing.assert_array_equal(near_order(centers.copy(), size), order)


def spread(centers: np.ndarray, order: np.ndarray, size: int) -> float:
    """The mean distance of points from the middle of their run."""
    runs = [centers[order[first : first + size]] for first in range(0, len(order), size)]
    return float(np.mean([np.linalg.norm(run - run.mean(axis=0), axis=1).mean() for run in runs]))


def test_runs_lie_close_together() -> None:
    centers = np.random.default_rng(1).uniform(size=(600, 3))
    shuffled = spread(centers, np.arange(600), 6)
    assert spread(centers, near_order(centers, 6), 6) < 0.3 * shuffled


def test_separate_heaps_are_not_mixed() -> None:
    """All runs but the last are whole, so that heaps of whole runs keep to themselves."""
    random = np.random.default_rng(2)
    heaps = np.repeat(np.arange(5), 12)
    centers = random.normal(size=(60, 3)) * 0.01 + np.array([3.0, 1.0, 0.0]) * heaps[:, None]
    mixed = random.permutation(60)
    order = near_order(centers[mixed], 6)
    of_runs = heaps[mixed][order].reshape(-1, 6)
    assert (of_runs == of_runs[:, :1]).all()


def test_runs_of_the_gripper_lie_as_close_as_its_spheres_are_large() -> None:
    centers = cover_gripper().centers_m
    assert spread(centers, near_order(centers, 6), 6) < 0.013
