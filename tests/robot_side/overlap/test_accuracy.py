"""Tetrahedra and boxes against the 50-digit reference, class by class, with the worst errors asserted.

Errors are fractions of the sphere's volume, great circle and surface.
"""

import itertools
import zlib
from collections.abc import Sequence

import numpy as np
import pytest
from mpmath import mpf

from common.arrays import FloatArray
from robot_side.overlap import sphere_box, sphere_tetrahedron
from tests.helpers.overlap.classes import BOXES, TETRAHEDRA
from tests.helpers.overlap.reference import Overlap, Polyhedron

WORST = {"volume": 1e-15, "gradient": 2e-15, "area": 1e-15}


def assert_accurate(
    results: tuple[FloatArray, FloatArray, FloatArray],
    radii: FloatArray,
    truth: Sequence[Overlap],
) -> None:
    """Hold every volume, gradient and area to its bound."""
    volumes, gradients, areas = results
    wholes = {"volume": 4 / 3 * np.pi * radii**3, "gradient": np.pi * radii**2, "area": 4 * np.pi * radii**2}
    errors = {
        "volume": [abs(mpf(v) - true.volume) for v, true in zip(volumes, truth, strict=True)],
        "gradient": [
            max(abs(mpf(a) - b) for a, b in zip(gradient, true.gradient, strict=True))
            for gradient, true in zip(gradients, truth, strict=True)
        ],
        "area": [abs(mpf(a) - true.area) for a, true in zip(areas, truth, strict=True)],
    }
    for name, error in errors.items():
        relative = np.array([float(e) for e in error]) / wholes[name]
        assert relative.max() <= WORST[name], (name, int(relative.argmax()), relative.max())


def _rng(name: str) -> np.random.Generator:
    return np.random.default_rng(zlib.crc32(name.encode()))


@pytest.mark.parametrize("name", TETRAHEDRA)
def test_tetrahedra_match_the_reference(name: str) -> None:
    centers, radii, vertices = TETRAHEDRA[name](_rng(name))
    results = sphere_tetrahedron(centers, radii, vertices, gradient=True)
    solids = [Polyhedron.tetrahedron(v) for v in vertices]
    truth = [solid.overlap(*sphere) for solid, *sphere in zip(solids, centers, radii, strict=True)]
    assert_accurate(results, radii, truth)
    assert any(true.volume > 0 for true in truth)


@pytest.mark.parametrize(
    ("center", "radius", "vertices"),
    [
        (
            [-0.25162593747458606, 0.4360392579414266, 0.3748546912138514],
            0.0008322727699515414,
            [
                [-1.3035029078083071, 1.933292742911719, 0.23180023576275277],
                [-0.02926608529093122, 1.0875151961339506, 0.8913138044451872],
                [0.7362529514292786, -0.9824995371313381, 0.526547168916321],
                [-0.1575054867104039, 0.30622125493623675, 0.38297093455855563],
            ],
        ),
        (
            [-0.00014874421643229507, 4.71115961800582e-05, -0.00016674427542140438],
            1.1289077467688542e-09,
            [
                [-0.00016436731854130047, 5.4036318961108714e-06, 0.00012591179473741212],
                [-0.00014897741349158245, 6.56821283373545e-05, -0.0002129618978727887],
                [-0.0001506379344936611, 5.917827341658696e-05, -0.00017639872178558314],
                [-8.697844529079273e-05, -0.0002853888388953899, -1.2812856245987086e-05],
            ],
        ),
    ],
)
def test_slivers_match_the_reference_however_their_vertices_are_numbered(
    center: list[float], radius: float, vertices: list[list[float]]
) -> None:
    orders = np.array([np.array(vertices)[list(order)] for order in itertools.permutations(range(4))])
    results = sphere_tetrahedron(np.array(center), radius, orders, gradient=True)
    truth = Polyhedron.tetrahedron(np.array(vertices)).overlap(np.array(center), radius)
    assert_accurate(results, np.full(24, radius), [truth] * 24)


@pytest.mark.parametrize("name", BOXES)
def test_boxes_match_the_reference(name: str) -> None:
    centers, radii, boxes, rotations, half_sizes = BOXES[name](_rng(name))
    results = sphere_box(centers, radii, boxes, rotations, half_sizes, gradient=True)
    solids = [Polyhedron.box(*box) for box in zip(boxes, rotations, half_sizes, strict=True)]
    truth = [solid.overlap(*sphere) for solid, *sphere in zip(solids, centers, radii, strict=True)]
    assert_accurate(results, radii, truth)
    assert any(true.volume > 0 for true in truth) or name.endswith("outside")


@pytest.mark.parametrize(
    ("center", "radius", "volume"),
    [
        # Both are reported to fail in a published implementation that decides on topology.
        ((0.5, 0.25, -0.5), 1.75, 7.309150964843473),
        ((1.25, 1.375, 1.75), 0.875, 0.0),
        ((0.0, 0.0, 0.0), 1.0, 4.0 / 3.0 * np.pi),
        ((1.0, 0.0, 0.0), 1.0, 2.0 / 3.0 * np.pi),
        ((1.0, 1.0, 0.0), 1.0, np.pi / 3.0),
        ((1.0, 1.0, 1.0), 1.0, np.pi / 6.0),
        ((2.0, 0.0, 0.0), 1.0, 0.0),
        ((4.0, 5.0, 0.0), 5.0, 0.0),
        ((3.0, 3.0, 2.0), 3.0, 0.0),
        ((0.0, 0.0, 0.0), 2.0, 8.0),
    ],
)
def test_exact_binary_cube(center: tuple[float, float, float], radius: float, volume: float) -> None:
    result = sphere_box(center, radius, (0, 0, 0), np.eye(3), (1, 1, 1))
    assert result == pytest.approx(volume, rel=1e-15, abs=1e-15 * radius**3)


def test_spheres_clear_of_the_solid_give_exactly_nothing() -> None:
    rng = np.random.default_rng(8)
    vertices, directions = rng.normal(size=(2000, 4, 3)), rng.normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    extent = np.einsum("nvi,ni->nv", vertices, directions).max(axis=1)
    highest = vertices[np.arange(2000), np.einsum("nvi,ni->nv", vertices, directions).argmax(axis=1)]
    radii = rng.uniform(0.1, 3.0, 2000)
    # The plane through the highest vertex across the direction parts the two by 1e-9.
    centers = highest + (radii + 1e-9)[:, None] * directions
    assert (np.einsum("ni,ni->n", centers, directions) - radii > extent).all()
    for result in sphere_tetrahedron(centers, radii, vertices, gradient=True):
        assert not result.any()
