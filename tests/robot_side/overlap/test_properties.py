"""Properties of every overlap: bounds, additivity, invariance and monotonicity."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from common.arrays import FloatArray
from robot_side.overlap import sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron

repeatable = settings(derandomize=True, deadline=None, max_examples=150)

# Integers and eighths produce the degenerate positions that random reals never reach.
coordinates = st.floats(-4.0, 4.0, width=32) | st.integers(-3, 3).map(float) | st.integers(-32, 32).map(lambda n: n / 8)
points = arrays.arrays(np.float64, 3, elements=coordinates)
corners = arrays.arrays(np.float64, (4, 3), elements=coordinates)
radii = st.floats(0.0, 5.0) | st.integers(0, 5).map(float) | st.integers(0, 40).map(lambda n: n / 8)
half_sizes = arrays.arrays(np.float64, 3, elements=st.floats(0.0, 3.0) | st.integers(0, 3).map(float))
seeds = st.integers(0, 2**32 - 1)

SUBNORMAL = 1e-300
"""Volume in m³ below which digits are lost, because doubles that small are subnormal"""

SIZE = 16.0
"""Upper bound of the distance between any two points that are drawn, in metres"""


def rounding(radius: float) -> float:
    """Return the allowed error of a volume in m³: 1e-15 of the sphere's, or more if SIZE is larger than the radius."""
    return 1e-15 * 4.2 * radius**2 * max(radius, SIZE)


def rotation(seed: int) -> FloatArray:
    return np.asarray(np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0])


def determinant_volume(vertices: FloatArray) -> float:
    return abs(float(np.linalg.det(vertices[1:] - vertices[0]))) / 6.0


@repeatable
@given(points, radii, radii, corners, st.floats(0.0, 1.0))
def test_a_tetrahedron_bounds_its_overlap_and_is_the_sum_of_its_parts(
    center: FloatArray, radius: float, other: float, vertices: FloatArray, share: float
) -> None:
    orders = np.array([vertices[list(order)] for order in itertools.permutations(range(4))])
    volumes, gradients, areas = sphere_tetrahedron(center, radius, orders, gradient=True)
    assert volumes.min() >= 0.0
    assert volumes.max() <= 4.0 / 3.0 * np.pi * radius**3 * (1.0 + 1e-15)
    assert volumes.max() <= determinant_volume(vertices) + 1e-15 * SIZE**3
    assert areas.min() >= 0.0
    assert areas.max() <= 4.0 * np.pi * radius**2 * (1.0 + 1e-15)
    assert np.linalg.norm(gradients, axis=1).max() <= np.pi * radius**2 * (1.0 + 1e-14) + 1e-15 * SIZE * radius
    # The order of the vertices has no effect.
    assert np.ptp(volumes) <= rounding(radius)
    assert np.ptp(gradients, axis=0).max() <= 2e-15 * 4.0 * max(radius, SIZE) * radius
    assert np.ptp(areas) <= 1e-15 * 13.0 * max(radius, SIZE) * radius
    # The parts of a cut tetrahedron add up. The cut is rounded, which moves the common face of both parts equally.
    cut = (1.0 - share) * vertices[2] + share * vertices[3]
    parts = np.stack([[*vertices[:3], cut], [vertices[0], vertices[1], cut, vertices[3]]])
    moved = 1e-15 * SIZE * 2.0 * np.pi * radius**2
    assert abs(volumes[0] - sphere_tetrahedron(center, radius, parts).sum()) <= 2.0 * rounding(radius) + moved
    # A larger sphere's overlap is not smaller.
    small, large = sphere_tetrahedron(center, sorted((radius, other)), vertices)
    assert small <= large + rounding(max(radius, other))


@repeatable
@given(points, radii, points, seeds, half_sizes)
def test_a_box_bounds_its_overlap_and_is_the_sum_of_six_tetrahedra(
    center: FloatArray, radius: float, box: FloatArray, seed: int, half: FloatArray
) -> None:
    volume, gradient, area = sphere_box(center, radius, box, rotation(seed), half, gradient=True)
    assert 0.0 <= volume <= 4.0 / 3.0 * np.pi * radius**3 * (1.0 + 1e-15)
    assert volume <= 8.0 * half.prod() * (1.0 + 1e-14) + SUBNORMAL
    assert 0.0 <= area <= 4.0 * np.pi * radius**2 * (1.0 + 1e-15)
    assert np.linalg.norm(gradient) <= np.pi * radius**2 * (1.0 + 1e-14) + 1e-15 * SIZE * radius
    whole = sphere_box(center, radius, box, np.eye(3), half)
    tetrahedra = []
    for order in itertools.permutations(range(3)):
        corner, path = box - half, [box - half]
        for axis in order:
            corner = corner.copy()
            corner[axis] = (box + half)[axis]
            path.append(corner)
        tetrahedra.append(path)
    parts = sphere_tetrahedron(center, radius, tetrahedra)
    assert abs(whole - parts.sum()) <= 4.0 * rounding(radius)


@repeatable
@given(points, radii, corners, points, seeds, half_sizes, st.integers(-60, 60))
def test_powers_of_two_scale_exactly(
    center: FloatArray,
    radius: float,
    vertices: FloatArray,
    box: FloatArray,
    seed: int,
    half: FloatArray,
    exponent: int,
) -> None:
    factor, turn = 2.0**exponent, rotation(seed)
    pairs = (
        (
            sphere_tetrahedron(center, radius, vertices),
            sphere_tetrahedron(factor * center, factor * radius, factor * vertices),
        ),
        (
            sphere_box(center, radius, box, turn, half),
            sphere_box(factor * center, factor * radius, factor * box, turn, factor * half),
        ),
    )
    for plain, scaled in pairs:
        # All results scale exactly, except for subnormal products of the smallest coordinates.
        assert scaled == np.float64(factor**3) * plain or plain < 1e-200


@repeatable
@given(corners, st.floats(-320.0, 0.0), st.floats(0.0, 3.0), seeds)
def test_a_sphere_however_small_shares_a_finite_volume(
    vertices: FloatArray, magnitude: float, away: float, seed: int
) -> None:
    radius = 10.0**magnitude
    center = vertices[0] + away * radius * rotation(seed)[0]
    volume, gradient, area = sphere_tetrahedron(center, radius, vertices, gradient=True)
    assert 0.0 <= volume <= 4.2 * radius**3 or volume < SUBNORMAL
    assert np.isfinite(gradient).all()
    assert np.isfinite(area)


wild = st.floats(-1e50, 1e50)
wild_points = arrays.arrays(np.float64, 3, elements=wild)


@repeatable
@given(
    wild_points,
    st.floats(0.0, 1e50),
    arrays.arrays(np.float64, (4, 3), elements=wild | st.floats(-1.0, 1.0)),
    wild_points,
    seeds,
    arrays.arrays(np.float64, 3, elements=st.floats(0.0, 1e50)),
    st.floats(0.0, 1e50),
)
def test_every_valid_input_gives_finite_results(
    center: FloatArray,
    radius: float,
    vertices: FloatArray,
    box: FloatArray,
    seed: int,
    half: FloatArray,
    other_radius: float,
) -> None:
    results = (
        *sphere_tetrahedron(center, radius, vertices, gradient=True),
        *sphere_box(center, radius, box, rotation(seed), half, gradient=True),
        *sphere_sphere(center, radius, box, other_radius, gradient=True),
        *sphere_half_space(center, radius, (0.6, 0.0, 0.8), box[0], gradient=True),
    )
    for result in results:
        assert np.isfinite(result).all()


def test_a_tetrahedron_that_is_nothing_beside_its_sphere_is_whole() -> None:
    """The lengths, found by hypothesis, have products that overflow or become 0 during the computation."""
    least = 6.13479543e-122
    vertices = np.full((4, 3), least)
    vertices[0, 0], vertices[1, 1], vertices[2, 2] = 0.0, 1.43633914e-60, 1.0
    volume, gradient, area = sphere_tetrahedron(np.zeros(3), 2.787593149816328e42, vertices, gradient=True)
    assert 0.0 < volume < 1e-180
    assert (gradient == 0.0).all()
    assert area == 0.0
