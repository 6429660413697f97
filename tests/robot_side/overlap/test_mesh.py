"""Overlaps with closed meshes equal the oracle's, in positions where overlap algorithms usually fail."""

import numpy as np
import pytest
from mpmath import mpf

from common.arrays import FloatArray, IntArray
from feelahead.lab.reference.oracle import true_mesh_overlap
from robot_side.overlap import Mesh
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES, grid_tetrahedra, round_mesh, surface_of

WORST = 1e-15
"""Largest error of a volume as a share of the sphere's, and of an area as a share of the sphere's surface. A gradient
may have an error of twice this share of the great circle."""

Rng = np.random.Generator


def assert_exact(vertices: FloatArray, triangles: IntArray, centers: FloatArray, radii: FloatArray) -> None:
    volumes, gradients, areas = Mesh(vertices, triangles).overlap(centers, radii, gradient=True)
    for row, (center, radius) in enumerate(zip(centers, radii.tolist(), strict=True)):
        truth, great_circle = true_mesh_overlap(center, radius, vertices, triangles), np.pi * radius**2
        assert truth.volume_error(volumes[row]) <= WORST * 4.0 / 3.0 * radius * great_circle
        assert truth.area_error(areas[row]) <= WORST * 4.0 * great_circle
        assert truth.gradient_error(gradients[row]) <= 2.0 * WORST * great_circle


def positions(rng: Rng, vertices: FloatArray, triangles: IntArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Draw spheres of three kinds: anywhere; centred on a corner, edge or face; or with such a point on the surface."""
    centers, radii = np.empty((count, 3)), np.empty(count)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    for number in range(count):
        kind, parts = number % 3, 1 + number // 3 % 3
        radii[number] = rng.uniform(0.2, 1.2)
        centers[number] = rng.uniform(low - 0.5, high + 0.5)
        if kind:
            corners = vertices[triangles[rng.integers(len(triangles))]]
            centers[number] = rng.dirichlet(np.ones(parts)) @ corners[:parts]
        if kind == 2:
            away = rng.normal(size=3)
            radii[number] = np.linalg.norm(away)
            centers[number] += away
    return centers, radii


@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_random_solids_with_parts_that_touch_at_edges_and_corners(jitter: float) -> None:
    rng = np.random.default_rng(3)
    vertices, tetrahedra = grid_tetrahedra(2)
    vertices += jitter * rng.uniform(-1.0, 1.0, vertices.shape)
    for _ in range(6):
        triangles = surface_of(tetrahedra[rng.uniform(size=len(tetrahedra)) < 0.4])
        centers, radii = positions(rng, vertices, triangles, 9)
        if jitter == 0.0:
            centers[::2] = rng.integers(0, 5, size=centers[::2].shape) / 2.0
        assert_exact(vertices, triangles, centers, radii)


def test_a_narrow_slit_and_a_thin_plate_through_the_centre() -> None:
    radius = 0.75
    for thickness in (1e-2, 1e-6, 1e-12, 1e-16):
        corners = CUBE_CORNERS * [2.0, 2.0, thickness]
        plate = Mesh(corners, CUBE_TRIANGLES)
        slit = Mesh(
            np.concatenate([CUBE_CORNERS * 3.0, corners]), np.concatenate([CUBE_TRIANGLES, CUBE_TRIANGLES[:, ::-1] + 8])
        )
        for x, z in ((0.0, 0.0), (0.25, thickness), (1.75, -thickness), (0.1, 0.5), (2.0, thickness)):
            center = np.array([x, 0.125, z])
            part = true_mesh_overlap(center, radius, corners, CUBE_TRIANGLES)
            whole = 4.0 / 3.0 * np.pi * radius**3
            assert abs(plate.overlap(center, radius) - part.volume) <= WORST * whole
            if x < 1.9 and abs(z) < 0.4:
                assert abs(slit.overlap(center, radius) - (mpf(whole) - part.volume)) <= WORST * whole


@pytest.mark.parametrize("length", [3.0, 10.0, 200.0, 1e4, 1e6])
def test_triangles_much_larger_than_the_sphere(length: float) -> None:
    """The mesh is a plate with two triangles on each side; spheres about as large as it is thick lie all over it."""
    rng, count = np.random.default_rng(5), 24
    centers = rng.uniform(-1.0, 1.0, (count, 3)) * [length, length, 1.3]
    centers[::3, 0] = length + rng.uniform(-1.0, 1.0, count // 3)
    centers[1::3, 1] = centers[1::3, 0] + rng.uniform(-0.7, 0.7, count // 3)
    assert_exact(CUBE_CORNERS * [length, length, 1.0], CUBE_TRIANGLES, centers, rng.uniform(0.3, 1.5, count))


@pytest.mark.parametrize("depth", [1e-3, 1e-6])
@pytest.mark.parametrize("fixed", [1, 2, 3])
def test_faces_edges_and_corners_barely_reached_keep_their_relative_accuracy(fixed: int, depth: float) -> None:
    rng = np.random.default_rng(6)
    mesh = Mesh(CUBE_CORNERS, CUBE_TRIANGLES)
    for number in range(8):
        away, place = np.zeros(3), rng.uniform(-0.8, 0.8, 3)
        away[:fixed], place[:fixed] = rng.uniform(0.2, 1.0, fixed), 1.0
        if number % 2 and fixed == 1:
            place[2] = place[1]
        radius = rng.uniform(0.3, 1.5)
        center = place + radius * (1.0 - depth) * away / np.linalg.norm(away)
        true = true_mesh_overlap(center, radius, CUBE_CORNERS, CUBE_TRIANGLES)
        volume, gradient, area = mesh.overlap(center, radius, gradient=True)
        assert true.volume_error(float(volume)) <= 1e-12 * true.volume
        assert true.area_error(float(area)) <= 1e-12 * true.area
        assert true.gradient_error(gradient) <= 1e-9 * np.linalg.norm(gradient)


def test_relabelling_and_splitting_change_nothing() -> None:
    rng = np.random.default_rng(9)
    vertices, triangles = round_mesh(4)
    centers, radii = rng.uniform(-1.5, 1.5, (100, 3)), rng.uniform(0.05, 1.0, 100)
    expected = Mesh(vertices, triangles).overlap(centers, radii)
    order, rows = rng.permutation(len(vertices)), rng.permutation(len(triangles))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    relabelled = Mesh(vertices[order], np.roll(place[triangles[rows]], 1, axis=1))
    sphere = 4.0 / 3.0 * np.pi * radii**3
    assert (np.abs(relabelled.overlap(centers, radii) - expected) <= WORST * sphere).all()
    # Each triangle has its own vertices; those with equal coordinates are merged.
    apart = Mesh(vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
    assert (np.abs(apart.overlap(centers, radii) - expected) <= WORST * sphere).all()


def test_a_query_touches_only_the_triangles_near_the_sphere() -> None:
    rng = np.random.default_rng(10)
    mesh = Mesh(*round_mesh(35))
    assert mesh.triangle_count == 9800
    centers = rng.normal(size=(100, 3))
    centers /= np.linalg.norm(centers, axis=1, keepdims=True)
    counts = mesh.counts(centers, 0.05)
    assert counts.min() > 5
    assert counts.max() < 60
    assert mesh.counts([0.0, 0.0, 0.0], 0.5) == 0
    assert mesh.counts([0.0, 0.0, 0.0], 2.0) == 0
    assert mesh.counts([0.0, 0.0, 2.0], 0.5) == 0
