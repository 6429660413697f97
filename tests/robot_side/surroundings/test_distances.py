"""Distances to primitives, compared with scipy's convex hulls and non-negative least squares; distances to objects."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.roles import Role
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import ellipsoid_mesh
from robot_side.surroundings.distances import object_distances
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.field.nearest_point import (
    Nearest,
    distance_to_object,
    nearest_on_box,
    nearest_on_tetrahedron,
)
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

ORIGIN = np.zeros(3)
TETRAHEDRON_M = np.array([[0.0, 0.0, 0.1], [0.3, 0.0, 0.1], [0.0, 0.3, 0.1], [0.0, 0.0, 0.4]])
seeds = st.integers(0, 2**32 - 1)
repeatable = settings(derandomize=True, deadline=None, max_examples=40)


# The nearest point of one primitive


def _check_against_hull(points: FloatArray, hulls: list[FloatArray], found: Nearest) -> None:
    """Compare found distances and directions with those to convex hulls, one hull for each point.

    For a point outside, the surface point that they lead to must be on the hull, so they are not too short. No convex
    combination of the vertices may be nearer, so they are not too long. Inside, the nearest facet's plane counts.
    """
    distances, directions = found
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    for point, vertices, distance, direction in zip(points, hulls, distances, directions, strict=True):
        equations = ConvexHull(vertices).equations
        heights = equations[:, :3] @ point + equations[:, 3]
        reached = equations[:, :3] @ (point + distance * direction) + equations[:, 3]
        assert reached.max() == pytest.approx(0.0, abs=1e-9)
        if heights.max() <= 0.0:
            assert distance == pytest.approx(heights.max(), abs=1e-9)
            continue
        emphasis = 1e4
        weights, _ = nnls(np.vstack([vertices.T, np.full(len(vertices), emphasis)]), np.append(point, emphasis))
        combination = weights / weights.sum() @ vertices
        assert distance > 0.0
        assert distance <= np.linalg.norm(combination - point) + 1e-9


def _boxes(rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    rotations = Rotation.random(count, rng=rng).as_matrix()
    return rng.normal(size=(count, 3)), rotations, rng.uniform(0.05, 1.0, (count, 3))


@repeatable
@given(seed=seeds, spread=st.sampled_from([0.3, 1.0, 10.0]))
def test_boxes_against_their_hulls(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    centers, rotations, half_sizes = _boxes(rng, 6)
    points = centers + rng.normal(size=(6, 3)) * spread * half_sizes
    hulls = [c + (CUBE_CORNERS * h) @ q.T for c, q, h in zip(centers, rotations, half_sizes, strict=True)]
    _check_against_hull(points, hulls, nearest_on_box(points, centers, rotations, half_sizes))


@repeatable
@given(seed=seeds, spread=st.sampled_from([0.1, 1.0, 10.0]), flip=st.booleans())
def test_tetrahedra_against_their_hulls(seed: int, spread: float, flip: bool) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(6, 4, 3))
    if flip:
        vertices = vertices[:, [1, 0, 2, 3]]
    points = vertices.mean(axis=1) + rng.normal(size=(6, 3)) * spread
    _check_against_hull(points, list(vertices), nearest_on_tetrahedron(points, vertices))


def test_points_on_the_surface_look_into_the_solid() -> None:
    on_box = nearest_on_box(np.array([[1.0, 0.2, 0.0]]), np.zeros((1, 3)), np.eye(3)[None], np.array([[1.0, 2.0, 3.0]]))
    on_tetrahedron = nearest_on_tetrahedron(
        np.array([[0.0, 0.2, 0.3]]), np.array([[[0.0, 0.0, 0.0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]])
    )
    for (distance, direction), into in ((on_box, [-1.0, 0.0, 0.0]), (on_tetrahedron, [1.0, 0.0, 0.0])):
        assert distance[0] == 0.0
        np.testing.assert_allclose(direction[0], into)


@pytest.mark.parametrize("thickness", [0.0, 1e-18, 1e-12])
def test_flat_tetrahedra_are_plates(thickness: float) -> None:
    rng = np.random.default_rng(8)
    points = rng.uniform(-1.0, 2.0, (300, 3))
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, thickness], [0.0, 1.0, 0.0]])
    distance, direction = nearest_on_tetrahedron(points, np.tile(vertices, (300, 1, 1)))
    nearest = np.clip(points, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0])
    np.testing.assert_allclose(distance, np.linalg.norm(nearest - points, axis=1), atol=1e-11)
    np.testing.assert_allclose(points + distance[:, None] * direction, nearest, atol=1e-6)


def test_a_tetrahedron_without_extent_gives_no_nan() -> None:
    distance, direction = nearest_on_tetrahedron(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]), np.zeros((2, 4, 3)))
    np.testing.assert_allclose(distance, [0.0, 5.0])
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0)
    np.testing.assert_allclose(direction[1], [-0.6, -0.8, 0.0])


# The distance from a point to an object


def test_each_kind_of_primitive_by_hand() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.3], 0.1)
    scene.add().box([0.5, 0.0, 0.0], [0.1, 1.0, 1.0])
    scene.add().tetrahedron(TETRAHEDRON_M)
    scene.add().half_space([0.0, 1.0, 0.0], -0.4)
    scene.add().mesh(Mesh(0.1 * CUBE_CORNERS, CUBE_TRIANGLES), [0.0, 0.4, 0.0])
    objects = scene.objects()
    found = [distance_to_object(objects, index, ORIGIN) for index in range(5)]
    assert found == pytest.approx([0.2, 0.4, 0.1, 0.4, 0.3])


def test_inside_is_negative() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.03], 0.1)
    scene.add().box([0.0, 0.0, 0.0], [0.05, 0.1, 0.2])
    scene.add().tetrahedron(TETRAHEDRON_M - [0.02, 0.1, 0.15])
    scene.add().half_space([0.0, 0.0, 1.0], 0.7)
    scene.add().mesh(Mesh(0.1 * CUBE_CORNERS, CUBE_TRIANGLES), [0.0, 0.04, 0.0])
    objects = scene.objects()
    found = [distance_to_object(objects, index, ORIGIN) for index in range(5)]
    assert found == pytest.approx([-0.07, -0.05, -0.02, -0.7, -0.06])


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


# The distances from spheres to all objects


@repeatable
@given(seed=seeds, reach_m=st.sampled_from([0.0, 0.1, 0.5, 5.0]))
def test_the_distance_to_each_object_is_the_least_over_all_spheres(seed: int, reach_m: float) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 2, 0.6, meshes=2)
    centers, radii = rng.uniform(-0.6, 0.6, (5, 3)), rng.uniform(0.01, 0.1, 5)
    found = object_distances(centers, radii, scene_table(objects), reach_m)
    for index, gap in enumerate(found):
        least = min(distance_to_object(objects, index, c) - r for c, r in zip(centers, radii, strict=True))
        assert gap == pytest.approx(least, abs=1e-12) if least <= reach_m else math.isinf(gap)


def test_meshes_and_what_they_describe_are_equally_far() -> None:
    ellipsoid = Mesh(*ellipsoid_mesh(np.full(3, 0.2), 12)[:2])
    rotation = random_rotation(np.random.default_rng(1))
    scene = Scene().add().mesh(ellipsoid, [0.3, 0.1, 0.0], rotation).add().sphere([0.3, 0.1, 0.0], 0.2)
    scene.add().mesh(Mesh(CUBE_CORNERS * [0.1, 0.2, 0.3], CUBE_TRIANGLES), [0.0, 0.0, 0.5], rotation)
    table = scene_table(scene.add().box([0.0, 0.0, 0.5], [0.1, 0.2, 0.3], rotation).objects())
    for center in np.random.default_rng(2).uniform(-1.0, 1.0, (40, 3)):
        round_mesh, sphere, of_faces, box = object_distances(center[None], np.array([0.03]), table, 10.0)
        assert of_faces == pytest.approx(box, abs=1e-12)
        # The mesh encloses the sphere, by less than 2 mm.
        assert sphere - 0.002 < round_mesh <= sphere + 1e-12
