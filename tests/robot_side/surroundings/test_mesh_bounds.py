import numpy as np
import pytest

from robot_side.overlap import Mesh, MeshLibrary
from robot_side.overlap.meshes.mesh_shapes import ellipsoid_mesh
from tests.helpers.meshes import CELL_M, CUBE_CORNERS, CUBE_TRIANGLES, cup
from tests.helpers.perceived_scenes import random_rotation

MESHES = {
    "cube": Mesh(0.5 * CUBE_CORNERS, CUBE_TRIANGLES),
    "plate": Mesh(CUBE_CORNERS * [1.0, 1.0, 0.01], CUBE_TRIANGLES),
    "cup": Mesh(cup()[0] / CELL_M / 2.0, cup()[1]),
    "ellipsoid": Mesh(*ellipsoid_mesh([0.5, 0.7, 1.0], 6)[:2]),
}


def test_bounds_contain_each_mesh_and_no_more() -> None:
    library = MeshLibrary(list(MESHES.values()))
    bounds = library.bounds
    for row, mesh in enumerate(MESHES.values()):
        np.testing.assert_allclose(bounds.middles_m[row], 0.5 * (mesh.lowest_m + mesh.highest_m), atol=1e-15)
        np.testing.assert_allclose(bounds.half_sizes_m[row], 0.5 * (mesh.highest_m - mesh.lowest_m))
        corners = mesh.tables.triangles[:, :9].reshape(-1, 3)
        reach = np.linalg.norm(corners - bounds.middles_m[row], axis=1).max()
        assert bounds.radii_m[row] == pytest.approx(reach, rel=1e-12)


def test_the_middles_go_where_the_meshes_do() -> None:
    corner = Mesh(CUBE_CORNERS + 1.0, CUBE_TRIANGLES)
    rotation = random_rotation(np.random.default_rng(1))
    at = np.array([[0.1, 0.2, 0.3]])
    found_m = MeshLibrary([corner]).placed_middles_m(np.zeros(1, dtype=np.int64), at, rotation[None])
    np.testing.assert_allclose(found_m, at + rotation @ np.ones(3))
