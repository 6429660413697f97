"""The precise kernels against the 50-digit reference, and their zeros against exact fractions."""

import zlib
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf

from common.arrays import FloatArray
from robot_side.compiled.kernel import Compiled
from robot_side.overlap import sphere_half_space, sphere_sphere
from robot_side.overlap.precise.kernels import precise_boxes, precise_tetrahedra
from tests.helpers.overlap.classes import BOXES, TETRAHEDRA
from tests.helpers.overlap.reference import Number, Overlap, Polyhedron

COUNT = 8
Arrays = tuple[FloatArray, ...]
Results = tuple[FloatArray, FloatArray, FloatArray]
KERNELS: dict[str, Compiled] = {"tetrahedron": precise_tetrahedra, "box": precise_boxes}
MAKERS: dict[str, dict[str, Callable[[np.random.Generator], Arrays]]] = {
    "tetrahedron": {**TETRAHEDRA},
    "box": {**BOXES},
}
CLASSES = [(kind, name) for kind, makers in MAKERS.items() for name in makers]


def overlaps(kind: str, arrays: Arrays) -> Results:
    """What the kernel makes of all rows."""
    count = len(arrays[1])
    results = np.full(count, np.nan), np.full((count, 3), np.nan), np.full(count, np.nan)
    KERNELS[kind](*(np.ascontiguousarray(array) for array in arrays), np.arange(count), *results)
    return results


def solids(kind: str, arrays: Arrays) -> list[Polyhedron]:
    if kind == "tetrahedron":
        return [Polyhedron.tetrahedron(vertices) for vertices in arrays[2]]
    return [Polyhedron.box(*box) for box in zip(*arrays[2:], strict=True)]


def reference(kind: str, arrays: Arrays) -> list[Overlap]:
    pairs = zip(solids(kind, arrays), arrays[0], arrays[1], strict=True)
    # The reference's 50 digits leave too few of an overlap of 1e-33 with a solid of a thousand radii.
    with mp.workdps(80):
        return [solid.overlap(center, radius) for solid, center, radius in pairs]


def norm(vector: tuple[Number, ...]) -> Number:
    return mp.sqrt(sum(x * x for x in vector))


def assert_within_the_sphere(kind: str, arrays: Arrays) -> None:
    """Errors of at most 1e-15 of the sphere's volume, 2e-15 of its great circle and of its surface."""
    volumes, gradients, areas = overlaps(kind, arrays)
    for i, truth in enumerate(reference(kind, arrays)):
        radius = arrays[1][i]
        assert abs(mpf(volumes[i]) - truth.volume) <= 1e-15 * 4 / 3 * np.pi * radius**3
        off = norm(tuple(mpf(g) - t for g, t in zip(gradients[i], truth.gradient, strict=True)))
        assert off <= 2e-15 * np.pi * radius**2
        assert abs(mpf(areas[i]) - truth.area) <= 2e-15 * 4 * np.pi * radius**2


@pytest.mark.parametrize(("kind", "name"), CLASSES)
def test_every_class_is_accurate(kind: str, name: str) -> None:
    arrays = MAKERS[kind][name](np.random.default_rng(zlib.crc32(name.encode())))
    assert_within_the_sphere(kind, tuple(array[:COUNT] for array in arrays))


def near_feature(
    kind: str, fixed: int, depth: float, size: float = 1.0, offset: float = 0.0, count: int = COUNT
) -> Arrays:
    """Spheres reaching by `depth` radii, as far as float64 can say, beyond a face (1), an edge (2) or a corner (3)."""
    rng = np.random.default_rng(zlib.crc32(f"{kind} {fixed} {depth} {size}".encode()))
    radii, away = rng.uniform(0.5, 2.0, count), np.zeros((count, 3))
    shift = offset * rng.normal(size=(count, 3))
    if kind == "box":
        rotations = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(count)])
        half_sizes, place = size * rng.uniform(0.2, 1.5, (count, 3)), rng.uniform(-0.8, 0.8, (count, 3))
        place[:, :fixed] = rng.choice((-1.0, 1.0), (count, fixed))
        away[:, :fixed] = place[:, :fixed] * rng.uniform(0.3, 1.0, (count, fixed))
        points, away = np.einsum("nij,nj->ni", rotations, half_sizes * place), np.einsum("nij,nj->ni", rotations, away)
        solid: Arrays = shift, rotations, half_sizes
    else:
        vertices = size * rng.normal(size=(count, 4, 3))
        weights = rng.exponential(size=(count, 4 - fixed)) + 0.3
        weights /= weights.sum(axis=1, keepdims=True)
        points = np.einsum("nv,nvi->ni", weights, vertices[:, : 4 - fixed])
        for opposite in range(4 - fixed, 4):
            a, b, c = (vertices[:, corner] for corner in range(4) if corner != opposite)
            normals = np.cross(b - a, c - a)
            outward = -np.sign(np.sum(normals * (vertices[:, opposite] - a), axis=1))
            normals *= (outward * rng.uniform(0.3, 1.0, count) / np.linalg.norm(normals, axis=1))[:, None]
            away += normals
        solid = (vertices + shift[:, None],)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    return points + (radii * (1.0 - depth))[:, None] * away + shift, radii, *solid


@pytest.mark.parametrize("kind", KERNELS)
@pytest.mark.parametrize("fixed", [1, 2, 3])
@pytest.mark.parametrize(("size", "offset"), [(1e-6, 0.0), (1e-3, 1e6), (1e3, 1e6), (1e6, 0.0), (1.0, 1e6)])
def test_extreme_ratios_and_offsets_are_accurate(kind: str, fixed: int, size: float, offset: float) -> None:
    for depth in (0.3, min(size, 1.0) * 0.3, 1.3):
        assert_within_the_sphere(kind, near_feature(kind, fixed, depth, size, offset, 4))


@pytest.mark.parametrize("kind", KERNELS)
@pytest.mark.parametrize("fixed", [1, 2, 3])
@pytest.mark.parametrize("depth", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-11])
def test_tiny_overlaps_are_relatively_accurate(kind: str, fixed: int, depth: float) -> None:
    for size in (1.0, 1e3):
        arrays = near_feature(kind, fixed, depth, size)
        volumes, gradients, areas = overlaps(kind, arrays)
        for i, truth in enumerate(reference(kind, arrays)):
            assert truth.volume > 0
            assert abs(volumes[i] / truth.volume - 1) <= 1e-12
            assert abs(areas[i] / truth.area - 1) <= 1e-12
            length, true_length = np.linalg.norm(gradients[i]), norm(truth.gradient)
            assert abs(length / true_length - 1) <= 1e-12
            pairs = zip(gradients[i], truth.gradient, strict=True)
            assert norm(tuple(mpf(g) / length - t / true_length for g, t in pairs)) <= 1e-14


@pytest.mark.parametrize("kind", KERNELS)
@pytest.mark.parametrize("fixed", [1, 2, 3])
def test_depths_below_rounding_still_give_something(kind: str, fixed: int) -> None:
    for depth in (1e-13, 1e-15, 3e-16):
        arrays = near_feature(kind, fixed, depth, count=40)
        volumes, gradients, areas = overlaps(kind, arrays)
        hit = np.array(distances_2(kind, arrays)) < np.array([Fraction(float(radius)) ** 2 for radius in arrays[1]])
        assert hit.sum() > 20
        assert ((volumes > 0) == hit).all()
        assert ((areas > 0) == hit).all()
        assert (np.linalg.norm(gradients, axis=1) > 0).tolist() == hit.tolist()


# Zeros, held to exact rational arithmetic.

Exact = list[Fraction]
FACES = {
    "tetrahedron": Polyhedron.tetrahedron(np.eye(4, 3)).faces,
    "box": Polyhedron.box((0, 0, 0), np.eye(3), (1, 1, 1)).faces,
}


def minus(a: Exact, b: Exact) -> Exact:
    return [x - y for x, y in zip(a, b, strict=True)]


def dot(a: Exact, b: Exact) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def cross(a: Exact, b: Exact) -> Exact:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def exact_corners(kind: str, arrays: Arrays, row: int) -> list[Exact]:
    """The corners relative to the centre, right-handed; none for a solid without volume."""
    center = [Fraction(x) for x in arrays[0][row].tolist()]
    if kind == "tetrahedron":
        a, b, c, d = (minus([Fraction(x) for x in vertex], center) for vertex in arrays[2][row].tolist())
        volume = dot(minus(b, a), cross(minus(c, a), minus(d, a)))
        corners = [a, b, d, c] if volume < 0 else [a, b, c, d]
        return corners if volume else []
    middle = minus([Fraction(x) for x in arrays[2][row].tolist()], center)
    rotation, half_sizes = arrays[3][row].tolist(), arrays[4][row].tolist()
    edges = [[Fraction(rotation[i][axis]) * Fraction(half_sizes[axis]) for i in range(3)] for axis in range(3)]
    volume = dot(edges[0], cross(edges[1], edges[2]))
    edges[0] = [-x for x in edges[0]] if volume < 0 else edges[0]
    signs = [[1 if corner >> axis & 1 else -1 for axis in range(3)] for corner in range(8)]
    corners = [
        [middle[i] + sum(s * e[i] for s, e in zip(sign, edges, strict=True)) for i in range(3)] for sign in signs
    ]
    return corners if volume else []


def distances_2(kind: str, arrays: Arrays) -> list[Fraction]:
    """The squared distances from the centres to the solids, exactly; R² where a solid has no volume."""
    return [
        distance_2(corners, FACES[kind])
        if (corners := exact_corners(kind, arrays, row))
        else Fraction(float(radius)) ** 2
        for row, radius in enumerate(arrays[1])
    ]


def distance_2(corners: list[Exact], faces: tuple[tuple[int, ...], ...]) -> Fraction:
    nearest, inside = min(dot(corner, corner) for corner in corners), True
    for face in faces:
        points = [corners[corner] for corner in face]
        normal = cross(minus(points[1], points[0]), minus(points[2], points[1]))
        height, foot_inside = dot(normal, points[0]), True
        inside = inside and height > 0
        for start, end in pairwise([*points, points[0]]):
            side = minus(end, start)
            foot_inside = foot_inside and dot(start, cross(side, normal)) > 0
            at = -dot(start, side) / dot(side, side)
            if 0 < at < 1:
                foot = [x + at * y for x, y in zip(start, side, strict=True)]
                nearest = min(nearest, dot(foot, foot))
        if foot_inside:
            nearest = min(nearest, height * height / dot(normal, normal))
    return Fraction(0) if inside else nearest


def whole_numbers(kind: str, rng: np.random.Generator, count: int) -> Arrays:
    """Grid-aligned pairs, which touch in every way, solids without volume among them."""
    centers = rng.integers(-5, 6, (count, 3)).astype(float)
    radii = rng.integers(1, 8, count).astype(float)
    if kind == "tetrahedron":
        return centers, radii, rng.integers(-4, 5, (count, 4, 3)).astype(float)
    middles, half_sizes = rng.integers(-2, 3, (count, 3)), rng.integers(0, 4, (count, 3))
    return centers, radii, middles.astype(float), np.tile(np.eye(3), (count, 1, 1)), half_sizes.astype(float)


@pytest.mark.parametrize("kind", KERNELS)
def test_zeros_are_exact_on_a_grid(kind: str) -> None:
    arrays = whole_numbers(kind, np.random.default_rng(11), 1000)
    volumes, gradients, areas = overlaps(kind, arrays)
    powers = [
        Fraction(radius) ** 2 - d for d, radius in zip(distances_2(kind, arrays), arrays[1].tolist(), strict=True)
    ]
    apart, touching = [power <= 0 for power in powers], [power == 0 for power in powers]
    assert sum(touching) > 20
    assert (volumes == 0).tolist() == apart
    assert not gradients[apart].any()
    assert not areas[apart].any()
    assert (volumes >= 0).all()
    assert (areas >= 0).all()


@pytest.mark.parametrize("kind", KERNELS)
def test_magnitudes_to_the_limits_of_validity_are_harmless(kind: str) -> None:
    rng = np.random.default_rng(12)
    arrays = near_feature(kind, 3, 0.4, count=300)
    scaled = [10.0 ** rng.uniform(-50.0, 49.0, 300) for _ in range(3)]
    centers, radii, solid, *box = arrays
    solid = solid * scaled[0].reshape(-1, *[1] * (solid.ndim - 1))
    shape = (*box[:1], box[1] * scaled[1][:, None]) if box else ()
    results = overlaps(kind, (centers * scaled[0][:, None], radii * scaled[2], solid, *shape))
    for result in results:
        assert np.isfinite(result).all()
    assert (results[0] >= 0).all()
    assert (results[0] <= 4.189 * (radii * scaled[2]) ** 3).all()


def test_relabelled_vertices_change_nothing_that_counts() -> None:
    rng = np.random.default_rng(13)
    for fixed, depth in ((1, 1e-4), (2, 1e-5), (3, 1e-4), (2, 0.3), (3, 0.8)):
        centers, radii, vertices = near_feature("tetrahedron", fixed, depth, count=50)
        volumes, _, _ = overlaps("tetrahedron", (centers, radii, vertices))
        others, _, _ = overlaps("tetrahedron", (centers, radii, vertices[:, rng.permutation(4)]))
        assert (np.abs(others - volumes) <= 1e-12 * volumes).all()


@pytest.mark.parametrize("kind", KERNELS)
@pytest.mark.parametrize("fixed", [1, 2, 3])
def test_volumes_grow_with_the_radius_across_every_form(kind: str, fixed: int) -> None:
    centers, radii, *solid = near_feature(kind, fixed, 0.0, count=1)
    growing = radii * (1.0 + np.concatenate([[0.0], np.geomspace(1e-15, 1.0, 2000)]))
    many = tuple(np.repeat(array, len(growing), axis=0) for array in solid)
    volumes, _, areas = overlaps(kind, (np.repeat(centers, len(growing), axis=0), growing, *many))
    assert (np.diff(volumes) >= -1e-12 * volumes[1:]).all()
    assert (volumes[:-1] + np.diff(growing) * areas[:-1] <= volumes[1:] * 10.0 + 1e-300).all()


def test_only_the_rows_named_are_written() -> None:
    arrays = near_feature("box", 2, 0.1)
    every = overlaps("box", arrays)
    results = np.full(COUNT, -1.0), np.full((COUNT, 3), -1.0), np.full(COUNT, -1.0)
    rows = np.array([5, 2])
    precise_boxes(*(np.ascontiguousarray(array) for array in arrays), rows, *results)
    others = np.setdiff1d(np.arange(COUNT), rows)
    for result, whole in zip(results, every, strict=True):
        assert (result[rows] == whole[rows]).all()
        assert (result[others] == -1.0).all()


# Caps and lenses.


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_half_spaces_are_relatively_accurate_at_every_depth(depth: float, offset: float) -> None:
    rng = np.random.default_rng(14)
    for normal in rng.normal(size=(20, 3)):
        center, radius = offset * rng.normal(size=3), rng.uniform(0.5, 2.0)
        level = float(normal @ center - (1.0 - depth) * radius * np.linalg.norm(normal))
        length = norm(tuple(mpf(x) for x in normal))
        height = (sum(mpf(a) * mpf(b) for a, b in zip(normal, center, strict=True)) - mpf(level)) / length
        gap = mpf(radius) - height
        volume, gradient, area = sphere_half_space(center, radius, normal, level, gradient=True)
        if gap <= 0:
            assert volume == 0
            continue
        assert abs(volume / (mp.pi * gap**2 * (3 * mpf(radius) - gap) / 3) - 1) <= 2e-15
        assert abs(area / (2 * mp.pi * mpf(radius) * gap) - 1) <= 2e-15
        disc = mp.pi * gap * (2 * mpf(radius) - gap)
        assert norm(tuple(mpf(g) / disc + mpf(n) / length for g, n in zip(gradient, normal, strict=True))) <= 2e-15


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("ratio", [1e-6, 1.0, 1e6])
def test_spheres_are_relatively_accurate_at_every_depth(depth: float, ratio: float) -> None:
    rng = np.random.default_rng(15)
    for direction in rng.normal(size=(20, 3)):
        first, second = rng.uniform(0.5, 2.0), ratio * rng.uniform(0.5, 2.0)
        small = min(first, second)
        center = rng.normal(size=3)
        other = center + (first + second - depth * small) * direction / np.linalg.norm(direction)
        distance = norm(tuple(mpf(a) - mpf(b) for a, b in zip(other, center, strict=True)))
        r, s = mpf(first), mpf(second)
        volume = sphere_sphere(center, first, other, second)
        if distance >= r + s:
            assert volume == 0
            continue
        middle = distance**2 + 2 * distance * (r + s) - 3 * (r - s) ** 2
        with mp.workdps(80):
            lens = mp.pi * (r + s - distance) ** 2 * middle / (12 * distance)
        assert abs(volume / lens - 1) <= 2e-15
