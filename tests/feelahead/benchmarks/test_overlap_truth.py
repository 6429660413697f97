"""The benchmark's truths against the tests' reference of another derivation, and its exact contact test."""

import math
from fractions import Fraction

import numpy as np
import pytest

from common.arrays import FloatArray
from feelahead.benchmarks.overlap.classes import frozen_classes
from feelahead.benchmarks.overlap.contact import contacts, exact_contact
from feelahead.benchmarks.overlap.meshes import torus
from feelahead.benchmarks.overlap.pairs import Pairs
from feelahead.benchmarks.overlap.truth import Truth, true_mesh_overlap, true_overlap, true_overlaps
from tests.helpers.overlap.reference import Polyhedron

CLASSES = frozen_classes(1)
FLAT_FACED = [name for name in CLASSES if name.startswith(("tetrahedron", "box")) and "without volume" not in name]
ROUND = [name for name in CLASSES if name.startswith(("half-space", "sphere"))]


def polyhedron(pairs: Pairs, row: int) -> Polyhedron:
    if pairs.solid == "tetrahedron":
        return Polyhedron.tetrahedron(pairs.parameters[0][row])
    center, rotation, half_sizes = (values[row] for values in pairs.parameters)
    return Polyhedron.box(center, rotation, half_sizes)


@pytest.mark.parametrize("name", FLAT_FACED)
def test_truth_equals_the_reference(name: str) -> None:
    pairs = CLASSES[name]
    truth = true_overlap(pairs, 0)
    expected = polyhedron(pairs, 0).overlap(pairs.centers[0], pairs.radii[0])
    radius = float(pairs.radii[0])
    # The reference moves the centre by up to 1e-30 R.
    assert abs(truth.volume - expected.volume) <= 1.3e-29 * radius**3
    assert abs(truth.area - expected.area) <= 1e-13 * radius**2
    for component, reference in zip(truth.gradient, expected.gradient, strict=True):
        assert abs(component - reference) <= 1e-13 * radius**2


def test_the_truth_is_exact_where_the_answer_is_known() -> None:
    eighth = Pairs("box", np.zeros((1, 3)), np.ones(1), (np.ones((1, 3)), np.eye(3)[None], np.ones((1, 3))))
    truth = true_overlap(eighth, 0)
    assert float(truth.volume) == pytest.approx(math.pi / 6.0, rel=1e-15)
    assert float(truth.area) == pytest.approx(math.pi / 2.0, rel=1e-15)
    assert truth.faces_cut == 3
    # A cap of a half-space, and two spheres a diameter across: π h² (3R - h)/3.
    height = 2.0**-20
    cap = Pairs(
        "half-space", np.zeros((1, 3)), np.ones(1), (np.array([[0.0, 0.0, 2.0]]), np.array([2.0 * (height - 1)]))
    )
    expected = Fraction(1, 2**40) * (3 - Fraction(1, 2**20)) / 3
    assert float(true_overlap(cap, 0).volume) == pytest.approx(math.pi * float(expected), rel=1e-15)
    lens = Pairs("sphere", np.zeros((1, 3)), np.ones(1), (np.array([[1.0, 0.0, 0.0]]), np.ones(1)))
    assert float(true_overlap(lens, 0).volume) == pytest.approx(5.0 * math.pi / 12.0, rel=1e-15)


@pytest.mark.parametrize("name", ROUND)
def test_round_truths_have_their_own_derivatives(name: str) -> None:
    pairs, step = CLASSES[name], 2.0**-30
    truth = true_overlap(pairs, 0)
    radius = float(pairs.radii[0])

    def at(shift: FloatArray, growth: float) -> Truth:
        return true_overlap(Pairs(pairs.solid, pairs.centers + shift, pairs.radii + growth, pairs.parameters), 0)

    grown = radius + step * radius - radius
    difference = at(np.zeros(3), grown).volume - truth.volume
    assert float(difference / grown / radius**2) == pytest.approx(float(truth.area / radius**2), abs=2e-7)
    for axis in range(3):
        shift = np.zeros(3)
        shift[axis] = step * radius
        moved = pairs.centers[0, axis] + shift[axis] - pairs.centers[0, axis]
        slope = float((at(shift, 0.0).volume - truth.volume) / moved / radius**2)
        assert slope == pytest.approx(float(truth.gradient[axis] / radius**2), abs=2e-7)


def test_a_mesh_of_the_same_surface_has_the_same_truth() -> None:
    pairs = frozen_classes(4)["tetrahedron, random, general"]
    triangles = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
    for row, truth in enumerate(true_overlaps(pairs)):
        mesh = true_mesh_overlap(pairs.centers[row], float(pairs.radii[row]), pairs.parameters[0][row], triangles)
        assert abs(mesh.volume - truth.volume) <= 1e-50


def test_the_torus_is_closed_and_oriented_outward() -> None:
    vertices, triangles = torus(20, 10)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forward = {tuple(edge) for edge in edges.tolist()}
    assert len(forward) == len(edges)
    assert {(b, a) for a, b in forward} == forward
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    volume = np.einsum("ni,ni->", a, np.cross(b, c)) / 6.0
    assert 0.85 * 2.0 * math.pi**2 * 0.35**2 < volume < 2.0 * math.pi**2 * 0.35**2
    whole = true_mesh_overlap(np.zeros(3), 2.0, vertices, triangles)
    assert float(whole.volume) == pytest.approx(volume, rel=1e-12)


def test_contact_is_exactly_whether_there_is_volume() -> None:
    for name, pairs in frozen_classes(2, seed=3).items():
        for row, touching in enumerate(contacts(pairs)):
            assert touching == exact_contact(pairs, row), name
            if pairs.solid in ("tetrahedron", "box") and "without volume" not in name:
                volume = polyhedron(pairs, row).overlap(pairs.centers[row], pairs.radii[row]).volume
                # The reference is off by up to 1e-29: it cannot tell less than that from nothing.
                if abs(volume) > 1e-28 * float(pairs.radii[row]) ** 3:
                    assert touching == (volume > 0), name


def box_below(gap: float) -> Pairs:
    """A unit sphere `gap` above the edge (gap 3/5, 4/5 away) of a unit cube, grid-aligned but for the gap."""
    corner = np.array([0.0, 3.0, 4.0]) * (5.0 + gap)
    return Pairs("box", corner[None], np.array([25.0]), (-np.ones((1, 3)), np.eye(3)[None], np.ones((1, 3))))


def test_contact_sees_the_last_digit() -> None:
    assert not exact_contact(box_below(0.0), 0)
    assert exact_contact(box_below(-1e-15), 0)
    assert not exact_contact(box_below(1e-15), 0)
    larger = box_below(0.0)
    assert exact_contact(Pairs("box", larger.centers, np.nextafter(larger.radii, 26.0), larger.parameters), 0)


def test_an_error_of_nan_is_infinite_and_directions_are_compared() -> None:
    truth = true_overlap(CLASSES["box, random, general"], 0)
    assert truth.volume_error(math.nan) == math.inf
    pairs = frozen_classes(1)["box, face depth 1e-3, grid"]
    truth = true_overlap(pairs, 0)
    gradient = np.array([float(component) for component in truth.gradient])
    assert truth.direction_error(3.0 * gradient) < 1e-15
    assert truth.direction_error(-gradient) == 1.0
    assert truth.direction_error(np.zeros(3)) == 1.0
    turned = gradient + 1e-3 * np.linalg.norm(gradient) * np.cross(gradient, [0.3, 0.5, 0.8]) / np.linalg.norm(gradient)
    assert 1e-5 < truth.direction_error(turned) < 1e-2
