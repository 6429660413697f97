import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.objects.perceived import Role
from robot_side.pairs.nearest_object import distance_to_object
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

ORIGIN = np.zeros(3)
TETRAHEDRON_M = np.array([[0.0, 0.0, 0.1], [0.3, 0.0, 0.1], [0.0, 0.3, 0.1], [0.0, 0.0, 0.4]])


def test_each_kind_of_primitive_by_hand() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.3], 0.1)
    scene.add().box([0.5, 0.0, 0.0], [0.1, 1.0, 1.0])
    scene.add().tetrahedron(TETRAHEDRON_M)
    scene.add().half_space([0.0, 1.0, 0.0], -0.4)
    objects = scene.objects()
    found = [distance_to_object(objects, index, ORIGIN) for index in range(4)]
    assert found == pytest.approx([0.2, 0.4, 0.1, 0.4])


def test_inside_is_negative() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.03], 0.1)
    scene.add().box([0.0, 0.0, 0.0], [0.05, 0.1, 0.2])
    scene.add().tetrahedron(TETRAHEDRON_M - [0.02, 0.1, 0.15])
    scene.add().half_space([0.0, 0.0, 1.0], 0.7)
    objects = scene.objects()
    found = [distance_to_object(objects, index, ORIGIN) for index in range(4)]
    assert found == pytest.approx([-0.07, -0.05, -0.02, -0.7])


def test_the_nearest_primitive_of_the_asked_object_counts_and_no_other_objects() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.01], 0.005)
    scene.add().sphere([1.0, 0.0, 0.0], 0.1).box([0.0, 0.6, 0.0], [0.1, 0.1, 0.1]).half_space([0.0, 0.0, 1.0], -0.7)
    scene.add().half_space([0.0, 0.0, 1.0], -0.02)
    objects = scene.objects()
    assert distance_to_object(objects, 1, ORIGIN) == pytest.approx(0.5)
    assert distance_to_object(objects, 1, np.array([0.8, 0.0, 0.0])) == pytest.approx(0.1)
    assert distance_to_object(objects, 1, np.array([0.0, 0.0, -0.6])) == pytest.approx(0.1)


def test_an_object_without_primitives_is_infinitely_far() -> None:
    objects = Scene().add(Role.IGNORED).add().sphere([0.0, 0.0, 0.1], 0.05).objects()
    assert distance_to_object(objects, 0, ORIGIN) == math.inf
    assert distance_to_object(objects, 1, ORIGIN) == pytest.approx(0.05)


@settings(derandomize=True, deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_way_of_that_length_leads_to_the_surface_and_none_shorter(seed: int) -> None:
    """The signed distance changes by no more than the way, and by all of it along some direction."""
    random = np.random.default_rng(seed)
    objects = random_scene(random, 2, 0.5)
    point = random.uniform(-0.5, 0.5, 3)
    directions = random.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for index in range(len(objects.names)):
        distance_m = distance_to_object(objects, index, point)
        step_m = 0.5 * abs(distance_m)
        moved = [distance_to_object(objects, index, point + step_m * direction) for direction in directions]
        changes = np.array(moved) - distance_m
        assert (np.abs(changes) <= step_m + 1e-12).all()
        assert np.abs(changes).max() > 0.8 * step_m


def test_a_box_of_tetrahedra_is_as_far_as_the_box() -> None:
    random = np.random.default_rng(5)
    center, half_sizes, rotation = random.normal(size=3) * 0.1, np.array([0.05, 0.1, 0.2]), random_rotation(random)
    scene = Scene().add().box(center, half_sizes, rotation).add()
    objects = scene.box_of_tetrahedra(center, half_sizes, rotation).objects()
    for point in random.uniform(-0.5, 0.5, (50, 3)):
        of_box, of_parts = (distance_to_object(objects, index, point) for index in (0, 1))
        if of_box > 0.0:
            assert of_parts == pytest.approx(of_box, abs=1e-12)
        else:
            assert of_parts < 0.0


def test_the_point_is_not_changed() -> None:
    point = np.array([0.1, 0.2, 0.3])
    objects = random_scene(np.random.default_rng(1), 1)
    for index in range(4):
        distance_to_object(objects, index, point)
    np.testing.assert_array_equal(point, [0.1, 0.2, 0.3])
