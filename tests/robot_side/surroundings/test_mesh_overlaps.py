"""Overlaps of spheres with one mesh of a scene, compared with the overlap library's; and which meshes are convex."""

import numpy as np
import pytest

from common.arrays import FloatArray, IntArray
from feelahead.lab.reference.meshes import torus
from robot_side.overlap import Mesh, MeshLibrary
from robot_side.overlap.meshes.mesh_pairs import mesh_pairs
from robot_side.overlap.meshes.mesh_shapes import capsule_mesh
from robot_side.surroundings.placed_meshes import overlap_one_mesh
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES, cup, hollow_cube, round_mesh
from tests.helpers.perceived_scenes import Scene, random_rotation

INT64, EQUAL = 300, 1e-12
Surface = tuple[FloatArray, IntArray]


SURFACES: dict[str, tuple[Surface, bool]] = {
    "cube": ((0.05 * CUBE_CORNERS, CUBE_TRIANGLES), True),
    "plate": ((CUBE_CORNERS * [0.4, 0.3, 0.0005], CUBE_TRIANGLES), True),
    "ball": ((0.05 * round_mesh(6)[0], round_mesh(6)[1]), True),
    "capsule": (capsule_mesh(0.02, 0.05, 4)[:2], True),
    "cup": (cup(), False),
    "hollow": (hollow_cube(), False),
    "torus": ((0.03 * torus(12, 6)[0], torus(12, 6)[1]), False),
}


def centers_about(mesh: Mesh, rng: np.random.Generator) -> FloatArray:
    """Draw points (n, 3) in and around a mesh; some have one, two or three coordinates of one of its corners."""
    size = mesh.highest_m - mesh.lowest_m
    centers: FloatArray = rng.uniform(mesh.lowest_m - 0.3 * size, mesh.highest_m + 0.3 * size, (INT64, 3))
    corners = mesh.tables.triangles[:, :9].reshape(-1, 3)[rng.integers(3 * mesh.triangle_count, size=INT64)]
    shared = rng.random((INT64, 3)) < [[0.0], [0.4], [0.7]][rng.integers(3)][0]
    return np.where(shared, corners, centers)


@pytest.mark.parametrize("radius_m", [0.0005, 0.004, 0.02, 0.08])
@pytest.mark.parametrize("name", SURFACES)
def test_a_mesh_has_the_overlap_of_the_library(name: str, radius_m: float) -> None:
    """Spheres are outside, at faces, edges and corners, or inside; small ones meet one plane, large ones swallow it."""
    rng = np.random.default_rng(len(name))
    library, rotation, position = MeshLibrary([Mesh(*SURFACES[name][0])]), random_rotation(rng), rng.normal(size=3)
    mesh = Mesh(*SURFACES[name][0])
    centers, radii = position + centers_about(mesh, rng) @ rotation.T, np.full(INT64, radius_m)
    table = scene_table(Scene().add().mesh(mesh, position, rotation).objects())
    volumes, gradients = np.empty(INT64), np.empty((INT64, 3))
    for k, center in enumerate(centers):
        volumes[k] = overlap_one_mesh(table.shapes, 0, *center.tolist(), radius_m, table.meshes, gradients[k])
    placed = np.tile(position, (INT64, 1)), np.tile(rotation, (INT64, 1, 1))
    expected = mesh_pairs(centers, radii, library.tables, np.zeros(INT64, dtype=np.int64), *placed)
    assert (np.abs(volumes - expected[0])).max() <= EQUAL * 4.0 / 3.0 * np.pi * radius_m**3
    # Right on an edge, the gradient is either face's.
    np.testing.assert_allclose(gradients, expected[1], rtol=0.0, atol=1e-9 * np.pi * radius_m**2)


def test_convex_meshes_are_told_from_those_with_dents_and_cavities() -> None:
    library = MeshLibrary([Mesh(*surface) for surface, _ in SURFACES.values()])
    assert library.convex.tolist() == [convex for _, convex in SURFACES.values()]


def test_a_dent_counts_from_a_tenth_of_a_micrometre_on() -> None:
    for depth_m, convex in ((1e-9, True), (1e-5, False)):
        flat = 0.05 * CUBE_CORNERS
        top = np.flatnonzero(flat[:, 2] > 0.0)
        dented = np.concatenate([flat, [[0.0, 0.0, 0.05 - depth_m]]])
        kept = [one for one in CUBE_TRIANGLES.tolist() if not set(one) <= set(top.tolist())]
        ring = sorted(top.tolist(), key=lambda k: np.arctan2(flat[k, 1], flat[k, 0]))
        lid = [[ring[k], ring[(k + 1) % 4], 8] for k in range(4)]
        assert MeshLibrary([Mesh(dented, kept + lid)]).convex.tolist() == [convex]
