"""Closed meshes to try the mesh kernels on, with the convex parts whose overlaps sum to theirs."""

from itertools import permutations

import numpy as np

from common.arrays import FloatArray, IntArray
from tests.helpers.overlap.reference import NOTHING, Coordinates, Overlap, Polyhedron

CUBE_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
CUBE_TRIANGLES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5]),
        *([0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]),
        *([0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)
TETRAHEDRON_TRIANGLES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def grid_tetrahedra(size: int) -> tuple[FloatArray, IntArray]:
    """A grid of size³ unit cubes: its vertices (v, 3) and positively oriented tetrahedra (6 size³, 4), 6 a cube."""
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
    """The outward triangles (t, 3) of positively oriented tetrahedra: the faces that no two of them share."""
    faces: dict[tuple[int, ...], IntArray] = {}
    for tetrahedron in tetrahedra:
        for face in tetrahedron[TETRAHEDRON_TRIANGLES]:
            key = tuple(sorted(face.tolist()))
            if faces.pop(key, None) is None:
                faces[key] = face
    return np.array(list(faces.values()))


def sum_of_parts(vertices: FloatArray, tetrahedra: IntArray, center: Coordinates, radius: float) -> Overlap:
    """The reference overlap with the solid that the tetrahedra make up."""
    volume, area = NOTHING.volume, NOTHING.area
    gradient = list(NOTHING.gradient)
    for tetrahedron in tetrahedra:
        part = Polyhedron.tetrahedron(vertices[tetrahedron]).overlap(center, radius)
        volume, area = volume + part.volume, area + part.area
        gradient = [total + own for total, own in zip(gradient, part.gradient, strict=True)]
    return Overlap(volume, (gradient[0], gradient[1], gradient[2]), area)


def ring(segments: int) -> tuple[FloatArray, IntArray]:
    """A torus of hexahedra: vertices (4 segments, 3), and the tetrahedra that make it up."""
    turns = 2.0 * np.pi * np.arange(segments) / segments
    profile = np.array([[1.0, -0.3], [1.7, -0.4], [1.6, 0.4], [0.9, 0.3]])
    places = np.array([[r * np.cos(t), r * np.sin(t), z] for t in turns for r, z in profile])
    tetrahedra = []
    for segment in range(segments):
        # A fan from the first corner of either end's square keeps neighbouring segments' diagonals the same.
        a, b = 4 * segment, 4 * ((segment + 1) % segments)
        for second, third in ((1, 2), (2, 3)):
            first, last = [a, a + second, a + third], [b, b + second, b + third]
            tetrahedra += [[*first, last[0]], [first[1], first[2], last[0], last[1]], [first[2], *last]]
    places_of = places[np.array(tetrahedra)]
    left_handed = np.linalg.det(places_of[:, 1:] - places_of[:, :1]) < 0.0
    result = np.array(tetrahedra)
    result[left_handed] = result[left_handed][:, [0, 1, 3, 2]]
    return places, result


def round_mesh(subdivisions: int) -> tuple[FloatArray, IntArray]:
    """An octahedron with `subdivisions` triangles along each edge, its vertices moved to the unit sphere."""
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
