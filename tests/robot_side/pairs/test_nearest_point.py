"""Nearest points against scipy's convex hulls and non-negative least squares, and their deepening vectors."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from tests.helpers.nearest_point import (
    box_deepening,
    nearest_on_box,
    nearest_on_half_space,
    nearest_on_sphere,
    nearest_on_tetrahedron,
    sphere_deepening,
    tetrahedron_deepening,
)

Nearest = tuple[FloatArray, FloatArray]
seeds = st.integers(0, 2**32 - 1)
repeatable = settings(derandomize=True, deadline=None, max_examples=40)
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def _check_against_hull(points: FloatArray, hulls: list[FloatArray], found: Nearest) -> None:
    """Compare with convex hulls, one for each point.

    Outside, the point reached lies on the hull (not too near), and no convex combination of the vertices
    lies nearer (not too far). Inside, the distance is that of the nearest facet plane.
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
    hulls = [c + (_CORNERS * h) @ q.T for c, q, h in zip(centers, rotations, half_sizes, strict=True)]
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


def _primitives(seed: int, count: int) -> dict[str, Callable[[FloatArray], Nearest]]:
    rng = np.random.default_rng(seed)
    centers, rotations, half_sizes = _boxes(rng, count)
    radii = rng.uniform(0.1, 1.0, count)
    vertices = rng.normal(size=(count, 4, 3))
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = rng.normal(size=count)
    return {
        "sphere": lambda points: nearest_on_sphere(points, centers, radii),
        "box": lambda points: nearest_on_box(points, centers, rotations, half_sizes),
        "tetrahedron": lambda points: nearest_on_tetrahedron(points, vertices),
        "half-space": lambda points: nearest_on_half_space(points, normals, offsets),
    }


@pytest.mark.parametrize("kind", ["sphere", "box", "tetrahedron", "half-space"])
def test_direction_is_the_negative_gradient_of_the_signed_distance(kind: str) -> None:
    count, step = 400, 1e-6
    nearest = _primitives(3, count)[kind]
    points = np.random.default_rng(4).normal(size=(count, 3))
    distance, direction = nearest(points)
    slopes = np.stack(
        [(nearest(points + e)[0] - nearest(points - e)[0]) / (2.0 * step) for e in np.eye(3) * step],
        axis=1,
    )
    # A few of the points lie within a step of a medial axis, where there is no gradient.
    agree = np.abs(slopes + direction).max(axis=1) < 1e-4
    assert agree.mean() > 0.99
    for inside in (distance < 0.0, distance > 0.0):
        assert inside.sum() >= 4
        assert agree[inside].mean() > 0.9


def test_spheres_and_half_spaces_by_hand() -> None:
    distance, direction = nearest_on_sphere(
        np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]]), np.zeros((3, 3)), np.ones(3)
    )
    np.testing.assert_allclose(distance, [2.0, -0.5, -1.0])
    np.testing.assert_allclose(direction[:2], [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    assert np.linalg.norm(direction[2]) == 1.0
    distance, direction = nearest_on_half_space(
        np.array([[1.0, 2.0, 3.0], [0.0, 0.0, -1.0]]), np.array([[0.0, 0.0, 1.0]] * 2), np.array([1.0, 1.0])
    )
    np.testing.assert_allclose(distance, [2.0, -2.0])
    np.testing.assert_allclose(direction, [[0.0, 0.0, -1.0]] * 2)


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


_DEEPENING: dict[str, tuple[Callable[[FloatArray], Nearest], Callable[[FloatArray], FloatArray]]] = {}
_BOX = (np.array([0.1, 0.2, 0.3]), Rotation.from_rotvec([0.3, -0.5, 0.7]).as_matrix(), np.array([1.0, 0.7, 0.5]))
_TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.5, 1.5, 0.0], [0.3, 0.4, 1.4]])


def _tiled(value: FloatArray, count: int) -> FloatArray:
    return np.broadcast_to(value, (count, *np.shape(value)))


_DEEPENING["sphere"] = (
    lambda p: nearest_on_sphere(p, _tiled(_BOX[0], len(p)), np.full(len(p), 0.8)),
    lambda p: sphere_deepening(p, _tiled(_BOX[0], len(p)), np.full(len(p), 0.8)),
)
_DEEPENING["box"] = (
    lambda p: nearest_on_box(p, *(_tiled(part, len(p)) for part in _BOX)),
    lambda p: box_deepening(p, *(_tiled(part, len(p)) for part in _BOX)),
)
_DEEPENING["tetrahedron"] = (
    lambda p: nearest_on_tetrahedron(p, _tiled(_TETRAHEDRON, len(p))),
    lambda p: tetrahedron_deepening(p, _tiled(_TETRAHEDRON, len(p))),
)


@pytest.mark.parametrize("kind", list(_DEEPENING))
def test_deepening_joins_the_direction_at_the_surface(kind: str) -> None:
    nearest, deepening = _DEEPENING[kind]
    points = np.random.default_rng(9).uniform(-1.0, 2.0, (5000, 3))
    distance, direction = nearest(points)
    inside = distance < 0.0
    assert inside.sum() > 100
    just_inside = points[inside] + (distance[inside, None] + 1e-6) * direction[inside]
    vectors = deepening(just_inside)
    np.testing.assert_allclose(vectors, direction[inside], atol=1e-3)
    assert (np.linalg.norm(deepening(points[inside]), axis=1) <= 1.0 + 1e-12).all()


@pytest.mark.parametrize("kind", list(_DEEPENING))
def test_deepening_is_continuous_across_the_medial_axis(kind: str) -> None:
    """Along a path through the solid, ten times the steps make the largest jump about a tenth."""
    nearest, deepening = _DEEPENING[kind]
    jumps = {}
    for count in (2001, 20001):
        path = np.linspace([-0.9, -0.4, -0.2], [1.1, 0.8, 0.8], count)
        inside = nearest(path)[0] < 0.0
        vectors = deepening(path[inside])
        jumps[count] = np.linalg.norm(np.diff(vectors, axis=0), axis=1).max()
        directions = nearest(path[inside])[1]
    assert np.linalg.norm(np.diff(directions, axis=0), axis=1).max() > 0.5, "the path misses the medial axis"
    assert jumps[20001] < 0.15 * jumps[2001]
    assert jumps[20001] < 0.01


def test_deepening_vanishes_where_every_way_out_is_as_long() -> None:
    assert not sphere_deepening(np.zeros((1, 3)), np.zeros((1, 3)), np.ones(1)).any()
    plate = (np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)), np.array([[1.0, 1.0, 0.01]] * 2))
    vectors = box_deepening(np.array([[0.3, 0.0, 0.0], [0.3, 0.0, 0.008]]), *plate)
    np.testing.assert_allclose(vectors[0], 0.0, atol=1e-7)
    np.testing.assert_allclose(vectors[1], [0.0, 0.0, -1.0], atol=1e-3)
