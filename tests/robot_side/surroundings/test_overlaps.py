"""Overlaps of spheres with one primitive of a scene, and their gradients, compared with the overlap library's."""

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.compiled.kernel import Compiled
from robot_side.overlap import sphere_box, sphere_tetrahedron
from robot_side.surroundings.kinds.box import overlap_one_box
from robot_side.surroundings.kinds.layout import rows
from robot_side.surroundings.kinds.tetrahedron import overlap_one_tetrahedron
from tests.helpers.perceived_scenes import random_rotation

INT64, EQUAL = 100, 1e-12
NO_MESHES = np.zeros((1, 2), dtype=np.int64)


def each(kernel: Compiled, shapes: FloatArray, centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the overlaps V (n,) and dV/dcentre (n, 3) of sphere k with shape k, for all k."""
    volumes, gradients = np.empty(len(radii)), np.empty((len(radii), 3))
    for k, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        volumes[k] = kernel(shapes, k, *center.tolist(), float(radius), NO_MESHES, gradients[k])
    return volumes, gradients


def assert_equal(found: tuple[FloatArray, ...], expected: tuple[FloatArray, ...], radii: FloatArray) -> None:
    """Assert that overlaps agree within 1e-12 of the sphere's volume, and gradients within 1e-12 of its great disc."""
    ball, disc = 4.0 / 3.0 * np.pi * radii**3, np.pi * radii**2
    assert (np.abs(found[0] - expected[0]) / ball).max() <= EQUAL
    assert (np.abs(found[1] - expected[1]) / disc[:, None]).max() <= EQUAL


def points_of(rng: np.random.Generator, feature: str, half: FloatArray) -> FloatArray:
    """Draw points (n, 3) inside boxes, or on their faces, edges or corners, as `feature` says."""
    at_ends = {"inside": 0, "face": 1, "edge": 2, "corner": 3}[feature]
    points: FloatArray = rng.uniform(-0.95, 0.95, (INT64, 3))
    ends = np.argsort(rng.random((INT64, 3))) < at_ends
    return np.where(ends, rng.choice((-1.0, 1.0), (INT64, 3)), points) * half


@pytest.mark.parametrize("ratio", [0.02, 0.3, 1.0, 3.0, 50.0], ids=lambda ratio: f"R/L {ratio}")
@pytest.mark.parametrize("thin", [0, 1, 2], ids=["box", "plate", "rod"])
@pytest.mark.parametrize("feature", ["inside", "face", "edge", "corner"])
def test_a_box_has_the_overlap_of_the_library(feature: str, thin: int, ratio: float) -> None:
    """ratio: size of the sphere to that of the box, from a sphere inside the box to a box inside the sphere."""
    rng = np.random.default_rng(len(feature))
    half = rng.uniform(0.02, 0.05, (INT64, 3))
    half[:, :thin] *= 1e-3
    radii = ratio * rng.uniform(0.02, 0.05, INT64)
    turned = np.array([random_rotation(rng) for _ in range(INT64)])
    middles = rng.uniform(-1.0, 1.0, (INT64, 3))
    offset = points_of(rng, feature, half) + rng.uniform(-1.1, 1.1, (INT64, 1)) * radii[:, None] * rng.normal(
        size=(INT64, 3)
    ) / np.sqrt(3.0)
    centers = middles + np.einsum("nij,nj->ni", turned, offset)
    found = each(overlap_one_box, rows(middles, turned, half), centers, radii)
    assert_equal(found, sphere_box(centers, radii, middles, turned, half, gradient=True), radii)


@pytest.mark.parametrize("ratio", [0.02, 0.3, 1.0, 3.0, 50.0], ids=lambda ratio: f"R/L {ratio}")
@pytest.mark.parametrize("flat", [1.0, 1e-3, 1e-6], ids=["solid", "thin", "splinter"])
@pytest.mark.parametrize("corners", [1, 2, 3, 4], ids=["corner", "edge", "face", "inside"])
def test_a_tetrahedron_has_the_overlap_of_the_library(corners: int, flat: float, ratio: float) -> None:
    rng = np.random.default_rng(corners)
    vertices = rng.normal(size=(INT64, 4, 3)) * 0.03
    vertices[:, :, 2] *= flat
    radii = ratio * rng.uniform(0.02, 0.05, INT64)
    shares = np.where(np.arange(4) < corners, rng.dirichlet(np.ones(4), INT64), 0.0)
    on_feature = np.einsum("nk,nki->ni", shares / shares.sum(axis=1, keepdims=True), vertices)
    centers = on_feature + radii[:, None] * rng.uniform(-0.7, 0.7, (INT64, 3))
    found = each(overlap_one_tetrahedron, rows(vertices), centers, radii)
    assert_equal(found, sphere_tetrahedron(centers, radii, vertices, gradient=True), radii)


@pytest.mark.parametrize("depth", [-1e-9, 0.0, 1e-9, 1e-3], ids=lambda depth: f"by {depth} radii")
def test_what_is_just_touched_has_an_overlap_of_nothing(depth: float) -> None:
    """Spheres that just touch a cube's corners, faces and edges: the overlap is the library's, and never below 0."""
    ways = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], dtype=float)
    count, radius = len(ways), 0.01
    out = ways / np.linalg.norm(ways, axis=1)[:, None]
    cubes = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)), np.full((count, 3), 0.05)
    centers, radii = 0.05 * ways + (1.0 - depth) * radius * out, np.full(count, radius)
    found = each(overlap_one_box, rows(*cubes), centers, radii)
    assert_equal(found, sphere_box(centers, radii, *cubes, gradient=True), radii)
    assert (found[0] >= 0.0).all()
