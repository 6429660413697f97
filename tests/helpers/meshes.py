"""Closed meshes for tests: convex ones and others."""

from itertools import permutations

import numpy as np

from common.arrays import FloatArray, IntArray

CUBE_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
CUBE_TRIANGLES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5]),
        *([0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]),
        *([0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)
TETRAHEDRON_TRIANGLES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
CELL_M = 0.04


def grid_tetrahedra(size: int) -> tuple[FloatArray, IntArray]:
    """Make a grid of size³ unit cubes: vertices (v, 3) and positively oriented tetrahedra (6 size³, 4), 6 a cube."""
    places = np.array([[x, y, z] for x in range(size + 1) for y in range(size + 1) for z in range(size + 1)])
    weights = np.array([(size + 1) ** 2, size + 1, 1])
    tetrahedra = []
    for cube in np.ndindex(size, size, size):
        for order in permutations(range(3)):
            corner = np.array(cube)
            path = [int(corner @ weights)]
            for axis in order:
                corner[axis] += 1
                path.append(int(corner @ weights))
            tetrahedra.append(
                path if order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else [path[0], path[2], path[1], path[3]]
            )
    return places.astype(np.float64), np.array(tetrahedra)


def surface_of(tetrahedra: IntArray) -> IntArray:
    """Return the outward triangles (t, 3) of a body of tetrahedra: the faces that belong to only one of them.

    The tetrahedra are positively oriented.
    """
    faces: dict[tuple[int, ...], IntArray] = {}
    for tetrahedron in tetrahedra:
        for face in tetrahedron[TETRAHEDRON_TRIANGLES]:
            key = tuple(sorted(face.tolist()))
            if faces.pop(key, None) is None:
                faces[key] = face
    return np.array(list(faces.values()))


def round_mesh(subdivisions: int) -> tuple[FloatArray, IntArray]:
    """Make an octahedron with `subdivisions` triangles along each edge, and move its vertices to the unit sphere."""
    numbers: dict[tuple[int, int, int], int] = {}
    triangles = []
    for signs in np.ndindex(2, 2, 2):
        x, y, z = (1 - 2 * sign for sign in signs)
        for i in range(subdivisions):
            for j in range(subdivisions - i):
                corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]
                for triple in ((0, 1, 2), (1, 3, 2)) if i + j < subdivisions - 1 else ((0, 1, 2),):
                    places = [
                        (x * corners[k][0], y * corners[k][1], z * (subdivisions - sum(corners[k]))) for k in triple
                    ]
                    indices = [numbers.setdefault(place, len(numbers)) for place in places]
                    triangles.append(indices if x * y * z > 0 else indices[::-1])
    vertices = np.array(list(numbers), dtype=np.float64)
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), np.array(triangles)


def cup() -> tuple[FloatArray, IntArray]:
    """Make a cup: a block of 3³ cubes without the middle cube and the cube above it. Each cube measures 40 mm.

    Return vertices (v, 3) in metres and triangles (t, 3). The mouth opens upward, 40 mm wide and 80 mm deep; the walls
    and the floor are 40 mm thick.
    """
    places, tetrahedra = grid_tetrahedra(3)
    middles = np.floor(places[tetrahedra].mean(axis=1))
    mouth = (middles[:, 0] == 1.0) & (middles[:, 1] == 1.0) & (middles[:, 2] >= 1.0)
    triangles = surface_of(tetrahedra[~mouth])
    used, numbers = np.unique(triangles, return_inverse=True)
    return CELL_M * (places[used] - 1.5), numbers.reshape(-1, 3)


def hollow_cube() -> tuple[FloatArray, IntArray]:
    """Return vertices and triangles of a cube of 90 mm with a cubic cavity of 30 mm in its middle."""
    places, tetrahedra = grid_tetrahedra(3)
    middle = (np.floor(places[tetrahedra].mean(axis=1)) == 1.0).all(axis=1)
    used, numbers = np.unique(surface_of(tetrahedra[~middle]), return_inverse=True)
    return 0.03 * (places[used] - 1.5), numbers.reshape(-1, 3)
