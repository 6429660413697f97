import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.gripper.spheres import cover_boxes


def random_boxes(count: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    random = np.random.default_rng(seed)
    rotations = np.array([np.linalg.qr(random.standard_normal((3, 3)))[0] for _ in range(count)])
    # Cubes, plates and rods.
    half_sizes = 10.0 ** random.uniform(-3.0, -1.0, (count, 3))
    return random.uniform(-0.2, 0.2, (count, 3)), rotations, half_sizes


@settings(derandomize=True, deadline=None, max_examples=60)
@given(boxes=st.integers(1, 6), count=st.integers(1, 40), seed=st.integers(0, 10_000))
def test_every_point_of_a_box_is_in_one_of_its_spheres(boxes: int, count: int, seed: int) -> None:
    centers, rotations, half_sizes = random_boxes(boxes, seed)
    cover = cover_boxes(centers, rotations, half_sizes, count)
    assert len(cover.radii_m) == max(count, boxes)
    random = np.random.default_rng(seed)
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    for box in range(boxes):
        unit = np.vstack([corners, random.uniform(-1.0, 1.0, (200, 3)), np.sign(random.uniform(-1, 1, (50, 3)))])
        points = centers[box] + (unit * half_sizes[box]) @ rotations[box].T
        of_box = cover.box == box
        apart = np.linalg.norm(points[:, None] - cover.centers_m[of_box][None], axis=2)
        assert (apart <= cover.radii_m[of_box] * (1.0 + 1e-9)).any(axis=1).all()


def test_one_sphere_circumscribes_a_box() -> None:
    cover = cover_boxes(np.array([[1.0, 2.0, 3.0]]), np.eye(3)[None], np.array([[0.1, 0.2, 0.2]]), 1)
    np.testing.assert_allclose(cover.centers_m, [[1.0, 2.0, 3.0]])
    np.testing.assert_allclose(cover.radii_m, [0.3])


def test_a_rod_is_cut_along_its_length() -> None:
    cover = cover_boxes(np.zeros((1, 3)), np.eye(3)[None], np.array([[0.01, 0.08, 0.01]]), 4)
    np.testing.assert_allclose(np.sort(cover.centers_m[:, 1]), [-0.06, -0.02, 0.02, 0.06])
    np.testing.assert_allclose(cover.radii_m, np.full(4, math.sqrt(0.01**2 + 0.02**2 + 0.01**2)))


def test_more_spheres_never_reach_farther() -> None:
    centers, rotations, half_sizes = random_boxes(3, 5)
    largest = [cover_boxes(centers, rotations, half_sizes, count).radii_m.max() for count in (3, 6, 12, 24, 48)]
    assert largest == sorted(largest, reverse=True)
    assert largest[-1] < 0.6 * largest[0]


def test_a_box_without_extent_keeps_its_one_sphere() -> None:
    cover = cover_boxes(np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, 3)), 8)
    np.testing.assert_array_equal(cover.radii_m, [0.0])


def test_bad_boxes_are_named() -> None:
    centers, rotations, half_sizes = random_boxes(2, 1)
    with pytest.raises(ValueError, match="count = 0"):
        cover_boxes(centers, rotations, half_sizes, 0)
    with pytest.raises(ValueError, match="half_sizes_m"):
        cover_boxes(centers, rotations, -half_sizes)
    with pytest.raises(ValueError, match="half_sizes_m has the shape"):
        cover_boxes(centers, rotations, half_sizes[:1])
    with pytest.raises(ValueError, match="centers_m holds NaN"):
        cover_boxes(np.full((2, 3), np.nan), rotations, half_sizes)
    with pytest.raises(ValueError, match="centers_m"):
        cover_boxes(centers[:0], rotations[:0], half_sizes[:0])
