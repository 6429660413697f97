"""Distances that people are shown, from the gripper to perceived objects; and the order that keeps spheres together."""

import numpy as np
import pytest

from common.roles import Role
from robot_side.gripper.near_order import near_order
from robot_side.surroundings.perceived_distances import PerceivedDistances, perceived_distances
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.field.nearest_point import distance_to_object
from tests.helpers.gripper_poses import cover_gripper, free_pose
from tests.helpers.perceived_scenes import Scene, random_scene

POSE = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]], [0.02, 0.03])
SPHERES = POSE.sphere_centers_m, POSE.sphere_radii_m


def test_the_nearest_and_the_target_are_found_far_and_near() -> None:
    scene = Scene().add(Role.SUPPORT).half_space([0.0, 0.0, 1.0], -0.14)
    scene.add(Role.TARGET).sphere([0.0, 0.0, 2.0], 0.1).add().box([0.5, 0.0, 0.0], [0.1, 0.1, 0.1])
    apart = perceived_distances(*SPHERES, scene_table(scene.objects()), 1, None)
    assert apart.nearest == "object2"
    assert apart.nearest_m == pytest.approx(0.37)
    assert apart.target_m == pytest.approx(1.88)


def test_what_is_held_or_too_far_is_no_distance() -> None:
    objects = Scene().add(Role.TARGET).sphere([0.0, 0.0, 0.05], 0.01).add().sphere([0.0, 9.0, 0.0], 0.1).objects()
    assert perceived_distances(*SPHERES, scene_table(objects), 0, 0) == PerceivedDistances()
    assert perceived_distances(*SPHERES, scene_table(objects), 0, None).target_m == pytest.approx(0.02)
    assert perceived_distances(*SPHERES, scene_table(objects), 1, None).target_m is None
    assert perceived_distances(*SPHERES, scene_table(Scene().objects()), None, None) == PerceivedDistances()


@pytest.mark.parametrize("seed", range(20))
def test_it_is_the_least_over_all_spheres_and_objects(seed: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 3, extent_m=1.5)
    spheres = list(zip(POSE.sphere_centers_m, POSE.sphere_radii_m, strict=True))
    expected = [
        min(distance_to_object(objects, index, center) - radius for center, radius in spheres)
        if role is not Role.SUPPORT
        else np.inf
        for index, role in enumerate(objects.roles)
    ]
    apart = perceived_distances(*SPHERES, scene_table(objects), None, None)
    assert apart.nearest == objects.names[int(np.argmin(expected))]
    assert apart.nearest_m == pytest.approx(min(expected), abs=1e-9)


def spread(centers: np.ndarray, order: np.ndarray, size: int) -> float:
    """Cut ordered points into runs of `size`; return the mean distance of the points from the middle of their run."""
    runs = [centers[order[first : first + size]] for first in range(0, len(order), size)]
    return float(np.mean([np.linalg.norm(run - run.mean(axis=0), axis=1).mean() for run in runs]))


def test_separate_heaps_are_not_mixed() -> None:
    """Heaps of 12 points give two whole runs of 6 each, so no run has points of two heaps."""
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
