"""Winding number and nearest point of placed meshes, against slow computations with every triangle."""

import numpy as np
import pytest

from common.arrays import FloatArray, IntArray
from feelahead.lab.reference.meshes import torus
from robot_side.overlap import Mesh, MeshLibrary
from robot_side.overlap.meshes.mesh_library import nearest_mesh_pairs
from robot_side.overlap.meshes.mesh_pairs import mesh_pairs
from tests.helpers.field.nearest_point import nearest_on_tetrahedron
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES, grid_tetrahedra, round_mesh, surface_of

Rng = np.random.Generator
Surface = tuple[FloatArray, IntArray]


def slow_winding(vertices: FloatArray, triangles: IntArray, points: FloatArray) -> FloatArray:
    """Return winding numbers from the solid angles of all triangles, as spherical triangles by L'Huilier's theorem."""
    total = np.zeros(len(points))
    for triangle in triangles:
        sides = vertices[triangle] - points[:, None]
        units = sides / np.linalg.norm(sides, axis=2, keepdims=True)
        a, b, c = units[:, 0], units[:, 1], units[:, 2]

        def arc(p: FloatArray, q: FloatArray) -> FloatArray:
            return np.asarray(2.0 * np.arctan2(np.linalg.norm(p - q, axis=1), np.linalg.norm(p + q, axis=1)))

        arcs = arc(b, c), arc(c, a), arc(a, b)
        half = sum(arcs) / 2.0
        product = np.tan(half / 2.0)
        for one in arcs:
            product = product * np.tan(np.maximum(half - one, 0.0) / 2.0)
        sign = np.sign(np.sum(a * np.cross(b, c), axis=1))
        total += sign * 4.0 * np.arctan(np.sqrt(np.maximum(product, 0.0)))
    return total / (4.0 * np.pi)


def random_surface(rng: Rng) -> Surface:
    vertices, tetrahedra = grid_tetrahedra(2)
    vertices += rng.uniform(-0.1, 0.1, vertices.shape)
    return vertices, surface_of(tetrahedra[rng.uniform(size=len(tetrahedra)) < rng.uniform(0.2, 0.9)])


def unplaced(count: int) -> tuple[IntArray, FloatArray, FloatArray]:
    return np.zeros(count, dtype=np.int64), np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))


def test_inside_and_outside_are_told_apart_everywhere() -> None:
    rng = np.random.default_rng(1)
    queries = 0
    for number in range(14):
        vertices, triangles = round_mesh(5) if number == 0 else torus(9, 4) if number == 1 else random_surface(rng)
        points = rng.uniform(vertices.min(axis=0) - 0.3, vertices.max(axis=0) + 0.3, (1600, 3))
        # Near corners, edges and faces, and in line with corners, rounding may choose another nearest feature.
        corners = vertices[triangles[rng.integers(len(triangles), size=900)]]
        weights = rng.dirichlet(np.full(3, 0.2), 900)
        points[:900] = np.einsum("nv,nvi->ni", weights, corners) + 1e-3 * rng.normal(size=(900, 3))
        points[900:1100, 0] = rng.choice(vertices[:, 0], 200)
        points[1000:1200, 1:] = vertices[rng.integers(len(vertices), size=200), 1:]
        with np.errstate(invalid="ignore"):  # a point on a vertex
            winding = slow_winding(vertices, triangles, points)
        certain = np.abs(winding - np.round(winding)) < 1e-6
        inside = np.round(winding[certain]) == 1.0
        mesh = Mesh(vertices, triangles)
        distances, _ = nearest_mesh_pairs(points[certain], MeshLibrary([mesh]), *unplaced(int(certain.sum())))
        np.testing.assert_array_equal(distances < 0.0, inside)
        radius = 1e-6
        shares = mesh.overlap(points[certain], radius) / (4.0 / 3.0 * np.pi * radius**3)
        away = np.abs(distances) > radius
        np.testing.assert_allclose(shares[away], inside[away], atol=1e-15)
        queries += int(certain.sum())
    assert queries > 20_000


def test_the_nearest_point_is_the_one_that_a_search_through_all_triangles_finds() -> None:
    rng = np.random.default_rng(2)
    for _ in range(3):
        vertices, triangles = random_surface(rng)
        points = rng.uniform(-0.5, 2.5, (200, 3))
        corners = vertices[triangles]
        plates = np.concatenate([corners, corners[:, :1]], axis=1)
        each = [nearest_on_tetrahedron(points, np.tile(plate, (len(points), 1, 1))) for plate in plates]
        distance = np.array([own[0] for own in each])
        nearest = distance.argmin(axis=0)
        towards = np.array([own[1] for own in each])[nearest, np.arange(len(points))]
        own, direction = nearest_mesh_pairs(points, MeshLibrary([Mesh(vertices, triangles)]), *unplaced(len(points)))
        np.testing.assert_allclose(np.abs(own), distance.min(axis=0), rtol=1e-12, atol=1e-15)
        second = np.partition(distance, 1, axis=0)[1]
        clear = second - distance.min(axis=0) > 1e-9
        outward = np.where(own[:, None] < 0.0, -direction, direction)
        shared = np.abs(np.sum(outward * towards, axis=1) - 1.0) < 1e-9
        assert shared[clear].all()


def test_a_library_places_each_of_its_meshes() -> None:
    rng = np.random.default_rng(4)
    surfaces = (CUBE_CORNERS, CUBE_TRIANGLES), round_mesh(6), random_surface(rng)
    meshes = [Mesh(*surface) for surface in surfaces]
    library = MeshLibrary(meshes)
    assert len(library) == 3
    count = 150
    index = rng.integers(3, size=count)
    rotations = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(count)])
    rotations *= np.sign(np.linalg.det(rotations))[:, None, None]
    positions = rng.normal(size=(count, 3))
    local, radii = rng.uniform(-1.0, 2.0, (count, 3)), rng.uniform(0.1, 1.0, count)
    centers = np.einsum("nij,nj->ni", rotations, local) + positions
    volumes, gradients, areas = mesh_pairs(centers, radii, library.tables, index, positions, rotations)
    distances, directions = nearest_mesh_pairs(centers, library, index, positions, rotations)
    for pair in range(count):
        volume, gradient, area = meshes[index[pair]].overlap(local[pair], radii[pair], gradient=True)
        assert volumes[pair] == pytest.approx(volume, abs=1e-14)
        assert areas[pair] == pytest.approx(area, abs=1e-13)
        np.testing.assert_allclose(gradients[pair], rotations[pair] @ gradient, atol=1e-13)
        alone = nearest_mesh_pairs(local[pair : pair + 1], MeshLibrary([meshes[index[pair]]]), *unplaced(1))
        assert distances[pair] == pytest.approx(alone[0][0], abs=1e-14)
        np.testing.assert_allclose(directions[pair], rotations[pair] @ alone[1][0], atol=1e-9)
