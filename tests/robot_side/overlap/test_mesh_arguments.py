"""Which meshes are accepted, and the errors for all others."""

import re

import numpy as np
import numpy.typing as npt
import pytest

from robot_side.overlap import Mesh, MeshLibrary, sphere_mesh
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES, TETRAHEDRON_TRIANGLES

TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
WITH_NAN = np.where(np.arange(12).reshape(4, 3) == 7, np.nan, TETRAHEDRON)
TWO_CUBES = np.concatenate([CUBE_TRIANGLES, CUBE_TRIANGLES + 8])
CUBE_AND_HOLE = np.concatenate([CUBE_TRIANGLES, CUBE_TRIANGLES[:, ::-1] + 8])


def two(shift: float, size: float) -> npt.NDArray[np.float64]:
    return np.concatenate([CUBE_CORNERS, size * CUBE_CORNERS + shift])


@pytest.mark.parametrize(
    ("vertices", "triangles", "text"),
    [
        (TETRAHEDRON[:, :2], TETRAHEDRON_TRIANGLES, "vertices has the shape (4, 2)"),
        (WITH_NAN, TETRAHEDRON_TRIANGLES, "vertices[2, 1] = nan"),
        (TETRAHEDRON, TETRAHEDRON_TRIANGLES[:, :2], "triangles has the shape (4, 2)"),
        (TETRAHEDRON, TETRAHEDRON_TRIANGLES[:0], "triangles has the shape (0, 3)"),
        (TETRAHEDRON, TETRAHEDRON_TRIANGLES * 1.0, "triangles has the type float64"),
        (TETRAHEDRON, TETRAHEDRON_TRIANGLES + 1, "triangles[0] = [2, 3, 4] names a vertex that does not exist"),
        (TETRAHEDRON, [[0, 1], [2]], "triangles is no rectangular array"),
        (TETRAHEDRON, TETRAHEDRON_TRIANGLES[:3], "triangles[0]: its edge from vertex 1 to 2 is used 1 times"),
        (TETRAHEDRON, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 2, 1]], "edge from vertex 2 to 3 is used 2 times"),
        (TETRAHEDRON, TETRAHEDRON_TRIANGLES[:, ::-1], "triangles[0] and those connected with it enclose -0.167 m³"),
        (TETRAHEDRON, [[0, 1, 2], [2, 1, 0]], "triangles enclose 0 m³"),
        (TETRAHEDRON, [[0, 0, 1]], "each of triangles has a corner twice"),
        (np.empty((0, 3)), TETRAHEDRON_TRIANGLES, "vertices is empty"),
        (
            TETRAHEDRON,
            np.concatenate([TETRAHEDRON_TRIANGLES, np.roll(TETRAHEDRON_TRIANGLES, 1, axis=1)]),
            "triangles[4] is triangles[0] again, with the same orientation",
        ),
        (two(5.0, 1.0), CUBE_AND_HOLE, "triangles[12] and those connected with it enclose -8 m³"),
        (two(0.0, 0.5), TWO_CUBES, "triangles[12] and those connected with it lie within another part"),
    ],
)
def test_what_is_no_solid_is_refused(vertices: npt.ArrayLike, triangles: npt.ArrayLike, text: str) -> None:
    for make in (Mesh, lambda v, t: sphere_mesh([0.0, 0.0, 0.0], 1.0, v, t)):
        with pytest.raises(ValueError, match=re.escape(text)):
            make(vertices, triangles)


@pytest.mark.parametrize(
    ("centers", "radii", "text"),
    [
        ([0.0, np.nan, 0.0], 1.0, "centers"),
        ([0.0, 0.0], 1.0, "centers has the shape (2,)"),
        ([0.0, 0.0, 0.0], -1.0, "radii = -1.0"),
        ([0.0, 0.0, 0.0], np.inf, "radii = inf"),
        (np.zeros((2, 3)), np.ones(3), "leading dimensions do not broadcast"),
    ],
)
def test_bad_spheres_are_refused(centers: npt.ArrayLike, radii: npt.ArrayLike, text: str) -> None:
    with pytest.raises(ValueError, match=re.escape(text)):
        sphere_mesh(centers, radii, TETRAHEDRON, TETRAHEDRON_TRIANGLES)


def test_what_is_unusual_but_closed_is_accepted() -> None:
    apart, touching = Mesh(two(5.0, 1.0), TWO_CUBES), Mesh(two(2.0, 1.0), TWO_CUBES)
    assert apart.volume_m3 == touching.volume_m3 == 16.0
    face_to_face = Mesh(np.concatenate([CUBE_CORNERS, CUBE_CORNERS + np.array([2.0, 0.0, 0.0])]), TWO_CUBES)
    assert face_to_face.overlap([1.0, 0.0, 0.0], 0.5) == pytest.approx(np.pi / 6.0, rel=1e-15)
    hollow = Mesh(two(0.0, 0.5), CUBE_AND_HOLE)
    assert hollow.volume_m3 == 7.0
    assert hollow.overlap([0.0, 0.0, 0.0], 0.5) == 0.0
    # A vertex within an edge makes a triangle without area, which is kept. A triangle with a corner twice is left out.
    split = np.concatenate([CUBE_CORNERS, [[-1.0, -1.0, 0.0]]])
    first = [[0, 8, 3], [8, 1, 3], [0, 1, 8], [5, 5, 2]]
    whole = Mesh(split, np.concatenate([first, CUBE_TRIANGLES[1:]]))
    centers = np.random.default_rng(1).uniform(-1.5, 1.5, (200, 3))
    centers[:3] = [-1.0, -1.0, 0.0], [-1.0, -1.0, 0.25], [-1.0, -1.0, -1.0]
    expected = Mesh(CUBE_CORNERS, CUBE_TRIANGLES).overlap(centers, 0.5)
    np.testing.assert_allclose(whole.overlap(centers, 0.5), expected, atol=1e-15)


def test_the_leading_dimensions_broadcast() -> None:
    mesh = Mesh(TETRAHEDRON, TETRAHEDRON_TRIANGLES)
    volumes, gradients, areas = mesh.overlap(np.zeros((2, 1, 3)), np.ones(4), gradient=True)
    assert volumes.shape == areas.shape == (2, 4)
    assert gradients.shape == (2, 4, 3)
    assert mesh.overlap(np.zeros((0, 3)), 1.0).shape == (0,)
    assert mesh.overlap([0.1, 0.1, 0.1], 0.0) == 0.0


@pytest.mark.parametrize("size", [1e-30, 1e-12, 1e12, 1e40])
def test_sizes_of_every_magnitude(size: float) -> None:
    mesh = Mesh(size * CUBE_CORNERS, CUBE_TRIANGLES)
    center = size * np.array([1.1, 0.2, 0.3])
    expected = Mesh(CUBE_CORNERS, CUBE_TRIANGLES).overlap([1.1, 0.2, 0.3], 0.5)
    assert mesh.overlap(center, 0.5 * size) == pytest.approx(float(expected) * size**3, rel=1e-13)
    for ratio in (1e-40, 1e-20, 1e-10, 1e5, 1e9):
        with np.errstate(all="raise"):
            results = mesh.overlap(center - [0.1 * size, 0.0, 0.0], size * ratio, gradient=True)
        assert all(np.isfinite(result).all() for result in results)
        assert 0.0 <= results[0] <= mesh.volume_m3


def test_parts_are_told_apart_however_many() -> None:
    places = 3.0 * np.array(list(np.ndindex(6, 6, 6)), dtype=float)
    vertices = (CUBE_CORNERS + places[:, None]).reshape(-1, 3)
    triangles = (CUBE_TRIANGLES + 8 * np.arange(len(places))[:, None, None]).reshape(-1, 3)
    assert Mesh(vertices, triangles).volume_m3 == pytest.approx(8.0 * len(places))
    inner = np.concatenate([vertices, CUBE_CORNERS / 4.0]), CUBE_TRIANGLES + len(vertices)
    with pytest.raises(ValueError, match="lie within another part"):
        Mesh(inner[0], np.concatenate([triangles, inner[1]]))
    hollow = Mesh(inner[0], np.concatenate([triangles, inner[1][:, ::-1]]))
    assert hollow.volume_m3 == pytest.approx(8.0 * len(places) - 8.0 / 64.0)


def test_a_meshes_tables_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        Mesh(TETRAHEDRON, TETRAHEDRON_TRIANGLES).tables.triangles[0, 0] = 5.0
    with pytest.raises(ValueError, match=re.escape("meshes[0] is of type NoneType")):
        MeshLibrary([None])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="meshes is empty"):
        MeshLibrary([])
