import numpy as np

from robot_side.gripper.near_order import near_order
from tests.helpers.gripper_poses import cover_gripper


def spread(centers: np.ndarray, order: np.ndarray, size: int) -> float:
    """The mean distance of points from the middle of their run."""
    runs = [centers[order[first : first + size]] for first in range(0, len(order), size)]
    return float(np.mean([np.linalg.norm(run - run.mean(axis=0), axis=1).mean() for run in runs]))


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
    np.testing.assert_array_equal(np.sort(near_order(centers, 6)), np.arange(len(centers)))
    assert spread(centers, near_order(centers, 6), 6) < 0.013
