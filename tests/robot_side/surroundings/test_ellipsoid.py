"""Ellipsoids: nearest point, first contact and overlap, compared with spheres, a fine mesh and an integral."""

import math
from itertools import pairwise

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.compiled.kernel import FLOAT64, compiled, input_array, output_array
from robot_side.compiled.vectors import load
from robot_side.overlap import sphere_sphere
from robot_side.surroundings.kinds import ellipsoid
from robot_side.surroundings.kinds.ellipsoid_sections import sum_slices
from robot_side.surroundings.kinds.layout import rows
from tests.helpers.perceived_scenes import random_rotation


@compiled(input_array(2), input_array(2), output_array(1), returns=FLOAT64)
def nearest(shapes: FloatArray, point: FloatArray, towards: FloatArray) -> float:
    distance, (towards[0], towards[1], towards[2]) = ellipsoid.nearest(shapes, 0, load(point, 0))
    return distance


@compiled(input_array(2), input_array(2), FLOAT64, input_array(2), FLOAT64, output_array(1))
def contact(
    shapes: FloatArray, start: FloatArray, radius: float, along: FloatArray, reach: float, found: FloatArray
) -> None:
    found[0], found[1] = ellipsoid.contact(shapes, 0, load(start, 0), radius, load(along, 0), reach)


NO_MESHES = np.zeros((1, 2), dtype=np.int64)


def shape(center: FloatArray, rotation: FloatArray, half_axes: FloatArray) -> FloatArray:
    return rows(center[None], rotation[None], half_axes[None])


def overlap(of: FloatArray, center: FloatArray, radius: float) -> tuple[float, FloatArray]:
    """Return the overlap V of a ball with an ellipsoid in m³, and dV/dcentre (3,) in m²."""
    overlap_gradient = np.empty(3)
    return ellipsoid.overlap_one_ellipsoid(of, 0, *center, radius, NO_MESHES, overlap_gradient), overlap_gradient


def beside(rng: np.random.Generator, half_axes: FloatArray, depth: float) -> tuple[FloatArray, FloatArray]:
    """Draw a point `depth` below the surface of an ellipsoid, and the normal there, in the ellipsoid's frame."""
    on_surface = rng.normal(size=3)
    on_surface *= half_axes / np.linalg.norm(on_surface)
    normal = on_surface / half_axes**2
    normal /= np.linalg.norm(normal)
    return on_surface - depth * normal, normal


@pytest.mark.parametrize("depth", [0.0, -1e-4, 1e-3])
def test_a_needle_that_pierces_the_balls_pole_pushes(depth: float) -> None:
    """The needle enters the ball between the ball's pole and the outermost computed section, so no section shows it."""
    of, radius, step = shape(np.zeros(3), np.eye(3), np.array([1e-4, 1e-4, 0.05])), 0.008, 1e-6
    before, after = (overlap(of, np.array([0.0, 0.0, 0.05 - depth + side]), radius)[0] for side in (-step, step))
    _, overlap_gradient = overlap(of, np.array([0.0, 0.0, 0.05 - depth]), radius)
    assert overlap_gradient[2] == pytest.approx((after - before) / (2.0 * step), rel=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_a_ball_is_a_sphere(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for k in range(250):
        own, radius = rng.uniform(0.002, 0.1, 2)
        rotation, at = (np.eye(3) if k % 4 == 0 else random_rotation(rng)), rng.uniform(-1.0, 1.0, 3)
        along = np.eye(3)[k % 3] if k % 4 == 0 else random_rotation(rng)[0]
        center = at + rng.uniform(0.8 * abs(own - radius), own + radius) * along
        volume, overlap_gradient = overlap(shape(at, rotation, np.full(3, own)), center, radius)
        expected, gradient, _ = sphere_sphere(center, radius, at, own, gradient=True)
        assert volume == pytest.approx(float(expected), abs=2e-9 * 4.0 / 3.0 * math.pi * radius**3)
        np.testing.assert_allclose(overlap_gradient, gradient, atol=2e-4 * radius**2)


def by_columns(half_axes: FloatArray, center: FloatArray, radius: float) -> float:
    """Integrate the overlap V over columns parallel to z, on a polar grid about the ball's centre."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    rho, turn = radius * np.sin(0.25 * math.pi * (nodes + 1.0)), np.arange(800) * math.tau / 800
    x, y = center[0] + rho[:, None] * np.cos(turn), center[1] + rho[:, None] * np.sin(turn)
    ball = np.sqrt(np.maximum(radius**2 - rho**2, 0.0))[:, None]
    inside = 1.0 - (x / half_axes[0]) ** 2 - (y / half_axes[1]) ** 2
    own = half_axes[2] * np.sqrt(np.maximum(inside, 0.0))
    length = np.minimum(center[2] + ball, own) - np.maximum(center[2] - ball, -own)
    length[(inside <= 0.0) | (length <= 0.0)] = 0.0
    step = 0.25 * math.pi * radius * np.cos(0.25 * math.pi * (nodes + 1.0)) * rho * weights
    return float((length.mean(axis=1) * math.tau * step).sum())


@pytest.mark.parametrize("seed", range(4))
def test_the_overlap_is_that_of_its_columns(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(20):
        half_axes, radius = rng.uniform(0.01, 0.06, 3), float(rng.uniform(0.004, 0.05))
        center, _ = beside(rng, half_axes, float(rng.uniform(-0.9, 1.0)) * radius)
        volume, overlap_gradient = overlap(shape(np.zeros(3), np.eye(3), half_axes), center, radius)
        assert volume == pytest.approx(by_columns(half_axes, center, radius), abs=1e-4 * radius**3)
        step = 1e-4 * radius
        for axis in range(3):
            shift = step * np.eye(3)[axis]
            rise = (
                overlap(shape(np.zeros(3), np.eye(3), half_axes), center + shift, radius)[0]
                - overlap(shape(np.zeros(3), np.eye(3), half_axes), center - shift, radius)[0]
            )
            assert overlap_gradient[axis] == pytest.approx(rise / (2.0 * step), abs=1e-4 * radius**2)


@compiled(input_array(2), input_array(2), FLOAT64, FLOAT64, returns=FLOAT64)
def summed(center: FloatArray, half_axes: FloatArray, low: float, high: float) -> float:
    volume, _ = sum_slices(load(center, 0), load(half_axes, 0), low, high)
    return volume


def test_sections_across_each_axis_make_up_the_same_to_a_billionth_of_the_ball() -> None:
    rng = np.random.default_rng(11)
    for _ in range(100):
        half_axes = 10.0 ** rng.uniform(-0.7, 1.0, 3)
        center, _ = beside(rng, half_axes, float(rng.uniform(-0.9, 0.9)))
        found = [overlap(shape(np.zeros(3), np.eye(3), half_axes), center, 1.0)[0]]
        for axis in range(3):
            order = np.roll(np.arange(3), 2 - axis)
            at, size = center[order][None], half_axes[order][None]
            ends = np.linspace(max(at[0, 2] - 1.0, -size[0, 2]), min(at[0, 2] + 1.0, size[0, 2]), 6)
            found.append(sum(summed(at, size, low, high) for low, high in pairwise(ends)))
        assert np.ptp(found) <= 1e-9 * 4.0 / 3.0 * math.pi


@pytest.mark.parametrize("seed", range(4))
def test_the_nearest_point_is_where_the_normal_leads(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(200):
        half_axes, at, rotation = 10.0 ** rng.uniform(-3.0, -0.5, 3), rng.uniform(-1.0, 1.0, 3), random_rotation(rng)
        # No deeper than the least radius of curvature.
        away = float(rng.uniform(-0.9 * half_axes.min() ** 2 / half_axes.max(), 0.5))
        point, normal = beside(rng, half_axes, -away)
        towards = np.empty(3)
        distance = nearest(shape(at, rotation, half_axes), (at + rotation @ point)[None], towards)
        assert distance == pytest.approx(away, abs=1e-12)
        np.testing.assert_allclose(towards, rotation @ -normal, atol=1e-6)


def test_the_middle_is_nearest_to_the_least_axis() -> None:
    half_axes = np.array([0.03, 0.01, 0.02])
    for point in ((0.0, 0.0, 0.0), (1e-3, 0.0, 0.0), (0.0, 0.0, 1e-3)):
        towards = np.empty(3)
        distance = nearest(shape(np.zeros(3), np.eye(3), half_axes), np.array([point]), towards)
        assert -0.01 <= distance < -0.0099
        assert abs(towards[1]) > 0.99


def test_a_sphere_first_touches_where_it_is_beside_it() -> None:
    rng = np.random.default_rng(7)
    for _ in range(300):
        half_axes, radius = 10.0 ** rng.uniform(-2.5, -1.0, 3), float(rng.uniform(0.001, 0.03))
        touching, normal = beside(rng, half_axes, -radius)
        along = random_rotation(rng)[0]
        along *= -np.sign(along @ normal)
        if along @ normal > -0.05:
            continue
        way = float(rng.uniform(0.001, 0.2))
        of = shape(np.zeros(3), np.eye(3), half_axes)
        found = np.empty(2)
        contact(of, (touching - way * along)[None], radius, along[None], 1.0, found)
        assert found[0] == pytest.approx(way, abs=1e-5)
        assert found[1] == pytest.approx(-along @ normal, abs=1e-2)
