"""Deepening vectors within meshes: as `nearest_point` has them within other primitives."""

from collections.abc import Callable

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.objects.mesh_bounds import mesh_bounds
from robot_side.overlap import Mesh, MeshLibrary
from robot_side.overlap.meshes.mesh_shapes import ellipsoid_mesh
from robot_side.pairs.nearest_on_meshes import nearest_on_meshes
from tests.helpers.nearest_point import box_deepening
from tests.helpers.overlap_meshes import CUBE_CORNERS, CUBE_TRIANGLES
from tests.helpers.perceived_scenes import random_rotation
from tests.helpers.scene_meshes import CELL_M, cup

Nearest = tuple[FloatArray, FloatArray, FloatArray]

POSITION = np.array([0.1, 0.2, 0.3])
ROTATION = random_rotation(np.random.default_rng(1))
PLATE_HALF_SIZES = np.array([1.0, 1.0, 0.01])
MESHES = {
    "cube": Mesh(0.5 * CUBE_CORNERS, CUBE_TRIANGLES),
    "plate": Mesh(CUBE_CORNERS * PLATE_HALF_SIZES, CUBE_TRIANGLES),
    "cup": Mesh(cup()[0] / CELL_M / 2.0, cup()[1]),
    "ellipsoid": Mesh(*ellipsoid_mesh([0.5, 0.7, 1.0], 6)[:2]),
}


def nearest_in(mesh: Mesh) -> Callable[[FloatArray], Nearest]:
    """Of points (p, 3) in the frame of the mesh, which itself stands somewhere else."""
    library = MeshLibrary([mesh])

    def nearest(points: FloatArray) -> Nearest:
        count = len(points)
        placed = np.tile(POSITION, (count, 1)), np.tile(ROTATION, (count, 1, 1))
        found = nearest_on_meshes(POSITION + points @ ROTATION.T, library, np.zeros(count, dtype=np.int64), *placed)
        return found[0], found[1] @ ROTATION, found[2] @ ROTATION

    return nearest


def points_in(mesh: Mesh, count: int) -> FloatArray:
    return np.random.default_rng(2).uniform(mesh.lowest_m, mesh.highest_m, (count, 3))


@pytest.mark.parametrize("name", MESHES)
def test_deepening_joins_the_direction_at_the_surface(name: str) -> None:
    nearest, points = nearest_in(MESHES[name]), points_in(MESHES[name], 3000)
    distance, direction, deepening = nearest(points)
    inside = distance < 0.0
    assert inside.sum() > 100
    np.testing.assert_array_equal(deepening[~inside], direction[~inside])
    assert (np.linalg.norm(deepening, axis=1) <= 1.0 + 1e-12).all()
    towards = direction[inside]
    just_inside, very_near = (points[inside] + (distance[inside, None] + depth) * towards for depth in (1e-6, 1e-12))
    # On the very edge between two faces the direction is in doubt. About the edges and corners of the cup's mouth it
    # turns, at any depth, within the ball that the vector is the mean over: at most by 0.036, at a corner.
    alike = np.linalg.norm(nearest(just_inside)[2] - towards, axis=1) < (0.04 if name == "cup" else 1e-3)
    assert alike.mean() > 0.99
    np.testing.assert_allclose(np.linalg.norm(nearest(very_near)[2], axis=1), 1.0, rtol=1e-9)


@pytest.mark.parametrize("name", ["cube", "cup", "ellipsoid"])
def test_deepening_is_continuous_across_the_medial_axis(name: str) -> None:
    """Along a path through the solid, ten times the steps make the largest jump about a tenth."""
    mesh, jumps = MESHES[name], {}
    nearest = nearest_in(mesh)
    for count in (2001, 20001):
        distance, direction, deepening = nearest(np.linspace(0.9 * mesh.lowest_m, [0.3, 0.2, -0.2], count))
        deep = (distance[1:] < -0.02) & (distance[:-1] < -0.02)
        assert deep.sum() > 0.2 * count
        jumps[count] = np.linalg.norm(np.diff(deepening, axis=0)[deep], axis=1).max()
        changes = np.linalg.norm(np.diff(direction, axis=0)[deep], axis=1)
    assert changes.max() > 10.0 * jumps[20001], "the path misses the medial axis"
    assert jumps[20001] < 0.15 * jumps[2001]


def test_deepening_vanishes_where_every_way_out_is_as_long() -> None:
    for name in ("cube", "ellipsoid"):
        np.testing.assert_allclose(nearest_in(MESHES[name])(np.zeros((1, 3)))[2], 0.0, atol=1e-12)
    heights = np.array([0.0, 0.008, 0.004, -0.004])
    vectors = nearest_in(MESHES["plate"])(np.column_stack([np.tile([0.3, 0.1], (4, 1)), heights]))[2]
    expected = [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(vectors, expected, atol=1e-9)


def test_deepening_is_near_to_that_of_a_box() -> None:
    points = np.random.default_rng(5).uniform(-0.5, 0.5, (2000, 3))
    boxes = np.zeros((2000, 3)), np.tile(np.eye(3), (2000, 1, 1)), np.full((2000, 3), 0.5)
    apart = np.linalg.norm(nearest_in(MESHES["cube"])(points)[2] - box_deepening(points, *boxes), axis=1)
    assert apart.mean() < 0.2
    assert apart.max() < 0.7


def test_it_turns_with_the_mesh() -> None:
    mesh = MESHES["cup"]
    points = points_in(mesh, 300)
    unplaced = nearest_on_meshes(
        points, MeshLibrary([mesh]), np.zeros(300, dtype=np.int64), np.zeros((300, 3)), np.tile(np.eye(3), (300, 1, 1))
    )
    for own, turned in zip(unplaced, nearest_in(mesh)(points), strict=True):
        np.testing.assert_allclose(own, turned, atol=1e-6)


def test_bounds_contain_each_mesh_and_no_more() -> None:
    library = MeshLibrary(list(MESHES.values()))
    bounds = mesh_bounds(library)
    assert mesh_bounds(library) is bounds
    for row, mesh in enumerate(MESHES.values()):
        np.testing.assert_allclose(bounds.middles_m[row], 0.5 * (mesh.lowest_m + mesh.highest_m), atol=1e-15)
        np.testing.assert_allclose(bounds.half_sizes_m[row], 0.5 * (mesh.highest_m - mesh.lowest_m))
        corners = mesh.tables.triangles[:, :9].reshape(-1, 3)
        reach = np.linalg.norm(corners - bounds.middles_m[row], axis=1).max()
        assert bounds.radii_m[row] == pytest.approx(reach, rel=1e-12)
