"""Spheres and half-spaces against closed forms, and the reference of the other tests against the definition."""

import numpy as np
import pytest
from mpmath import mp, mpf

from common.arrays import FloatArray
from robot_side.overlap import sphere_box, sphere_half_space, sphere_sphere
from tests.helpers.overlap.reference import Number, Polyhedron

COUNT = 200


def _lens(distance: Number, first: Number, second: Number) -> Number:
    """The volume common to two spheres, as textbooks print it."""
    if distance >= first + second:
        return mpf(0)
    if distance <= abs(first - second):
        return 4 * mp.pi / 3 * min(first, second) ** 3
    middle = distance**2 + 2 * distance * (first + second) - 3 * (first - second) ** 2
    return mp.pi * (first + second - distance) ** 2 * middle / (12 * distance)


def _distance(a: FloatArray, b: FloatArray) -> Number:
    return mp.sqrt(sum((mpf(x) - mpf(y)) ** 2 for x, y in zip(a, b, strict=True)))


@pytest.mark.parametrize("ratio", [1e-3, 0.1, 1.0, 10.0, 1e3])
@pytest.mark.parametrize("touching", ["anyhow", "outside", "inside"])
def test_two_spheres_match_the_lens(ratio: float, touching: str) -> None:
    rng = np.random.default_rng(1)
    centers, radii = rng.normal(size=(COUNT, 3)), rng.uniform(0.5, 2.0, COUNT)
    others = ratio * rng.uniform(0.5, 2.0, COUNT)
    directions = rng.normal(size=(COUNT, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    low, high = np.abs(radii - others), radii + others
    distances = {"anyhow": rng.uniform(low, high), "outside": high, "inside": low}[touching]
    other_centers = centers + distances[:, None] * directions
    volumes, gradients, areas = sphere_sphere(centers, radii, other_centers, others, gradient=True)
    step = mpf("1e-20")
    for i in range(COUNT):
        distance, first, second = _distance(centers[i], other_centers[i]), mpf(radii[i]), mpf(others[i])
        size, larger = min(radii[i], others[i]), max(radii[i], others[i]) + float(distance)
        # Rounding the distance moves a disc no larger than the smaller sphere's.
        disc, rounding = np.pi * size**2, 1e-15 * larger
        assert abs(volumes[i] - _lens(distance, first, second)) <= disc * rounding
        closer = (_lens(distance - step, first, second) - _lens(distance + step, first, second)) / (2 * step)
        wider = (_lens(distance, first + step, second) - _lens(distance, first - step, second)) / (2 * step)
        # Near an internal or external contact dV/ddistance falls to 0 as fast as a multiple of the gap.
        allowed = 2 * np.pi * rounding * size * (1 + larger / float(distance))
        toward = (other_centers[i] - centers[i]) / float(distance)
        assert abs(gradients[i] @ toward - closer) <= allowed
        assert np.linalg.norm(gradients[i] - (gradients[i] @ toward) * toward) <= allowed
        assert abs(areas[i] - wider) <= 2 * np.pi * radii[i] * rounding * (1 + larger / float(distance))


def test_coincident_and_nested_spheres() -> None:
    centers = np.zeros((4, 3))
    volumes, gradients, areas = sphere_sphere(
        centers, [1.0, 1.0, 2.0, 0.0], centers, [1.0, 2.0, 1.0, 1.0], gradient=True
    )
    ball, surface = 4.0 / 3.0 * np.pi, 4.0 * np.pi
    assert volumes.tolist() == pytest.approx([ball, ball, ball, 0.0], rel=1e-15)
    assert areas.tolist() == pytest.approx([surface, surface, 0.0, 0.0], rel=1e-15)
    assert not gradients.any()


def test_half_spaces_match_the_cap() -> None:
    rng = np.random.default_rng(2)
    centers, radii = rng.normal(size=(COUNT, 3)), np.exp(rng.uniform(-3.0, 3.0, COUNT))
    normals = rng.normal(size=(COUNT, 3))
    lengths = np.linalg.norm(normals, axis=1)
    offsets = np.einsum("ni,ni->n", centers, normals) + rng.uniform(-1.2, 1.2, COUNT) * radii * lengths
    volumes, gradients, areas = sphere_half_space(centers, radii, normals, offsets, gradient=True)
    for i in range(COUNT):
        center, normal = [mpf(x) for x in centers[i]], [mpf(x) for x in normals[i]]
        length = mp.sqrt(sum(x**2 for x in normal))
        height = (sum(a * b for a, b in zip(center, normal, strict=True)) - mpf(offsets[i])) / length
        radius = mpf(radii[i])
        depth = min(max(radius - height, mpf(0)), 2 * radius)
        disc = mp.pi * depth * (2 * radius - depth)
        # The distance of the plane rounds with the distances of centre and plane from the origin.
        scale = float(radius) + np.linalg.norm(centers[i]) + abs(offsets[i]) / lengths[i]
        rounding = 4e-16 * scale
        assert abs(volumes[i] - mp.pi * depth**2 * (3 * radius - depth) / 3) <= np.pi * radii[i] ** 2 * rounding
        for got, direction in zip(gradients[i], normal, strict=True):
            assert abs(got + disc * direction / length) <= 4 * np.pi * radii[i] * rounding
        assert abs(areas[i] - 2 * mp.pi * radius * depth) <= 4 * np.pi * radii[i] * rounding


@pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6])
def test_shallow_caps_keep_their_relative_accuracy(depth: float) -> None:
    radius, offset = 0.75, 0.5
    height = mpf(radius + offset - depth * radius)
    volume = sphere_half_space((0.0, 0.0, float(height)), radius, (0.0, 0.0, 1.0), offset)
    gap = mpf(radius) + mpf(offset) - height
    cap = mp.pi * gap**2 * (3 * mpf(radius) - gap) / 3
    assert abs(volume - cap) / cap <= 1e-15 / depth


def test_a_wide_box_is_a_half_space() -> None:
    rng = np.random.default_rng(3)
    centers, radii = rng.uniform(-1.0, 1.0, (COUNT, 3)), rng.uniform(0.5, 1.5, COUNT)
    box = sphere_box(centers, radii, (0.0, 0.0, -8.0), np.eye(3), (8.0, 8.0, 8.0), gradient=True)
    half_space = sphere_half_space(centers, radii, (0.0, 0.0, 1.0), 0.0, gradient=True)
    for one, other in zip(box, half_space, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=4e-14)


def _cases() -> list[tuple[Polyhedron, FloatArray, float]]:
    rng = np.random.default_rng(4)
    cases = [(Polyhedron.tetrahedron(rng.normal(size=(4, 3))), 0.3 * rng.normal(size=3), 0.9) for _ in range(3)]
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    box = Polyhedron.box(rng.normal(size=3) * 0.2, rotation, (0.5, 0.8, 1.1))
    return [
        *cases,
        (box, 0.5 * rng.normal(size=3), 1.0),
        (Polyhedron.box((0, 0, 0), np.eye(3), (1, 1, 1)), np.array([0.5, 0.25, -0.5]), 1.75),
    ]


@pytest.mark.parametrize("case", range(5))
def test_the_reference_integrates_the_definition(case: int) -> None:
    solid, center, radius = _cases()[case]
    volume = solid.overlap(center, radius).volume
    assert volume > 0
    assert abs(solid.volume_by_slices(center, radius) - volume) <= mpf("1e-19")


@pytest.mark.parametrize("case", range(5))
def test_the_references_derivatives_are_those_of_its_volume(case: int) -> None:
    solid, place, size = _cases()[case]
    center, radius, step = [mpf(x) for x in place], mpf(size), mpf("1e-14")
    overlap = solid.overlap(center, radius)
    for axis in range(3):
        ahead, behind = list(center), list(center)
        ahead[axis] += step
        behind[axis] -= step
        change = solid.overlap(ahead, radius).volume - solid.overlap(behind, radius).volume
        assert abs(change / (2 * step) - overlap.gradient[axis]) <= mpf("1e-25")
    change = solid.overlap(center, radius + step).volume - solid.overlap(center, radius - step).volume
    assert abs(change / (2 * step) - overlap.area) <= mpf("1e-25")
