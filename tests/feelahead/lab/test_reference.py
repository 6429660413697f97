"""The oracle of overlaps, compared with their definition (eq. 11), and the classes of pairs for comparisons."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from common.arrays import FloatArray
from feelahead.lab.reference.classes import MAKERS, frozen_class, frozen_classes
from feelahead.lab.reference.contact import contacts, exact_contact
from feelahead.lab.reference.errors import count_failures
from feelahead.lab.reference.oracle import Truth, true_mesh_overlap, true_overlap, true_overlaps
from feelahead.lab.reference.pairs import Pairs
from tests.helpers.meshes import TETRAHEDRON_TRIANGLES


@pytest.mark.parametrize("solid", MAKERS)
def test_the_oracles_derivatives_are_those_of_its_volume(solid: str) -> None:
    _, pairs = frozen_class(solid, "random", 6, seed=2)
    step = 2.0**-30
    for row, truth in enumerate(true_overlaps(pairs)):
        one = pairs[slice(row, row + 1)]
        radius = float(one.radii[0])

        def at(shift: FloatArray, growth: float, one: Pairs = one) -> Truth:
            return true_overlap(replace(one, centers=one.centers + shift, radii=one.radii + growth), 0)

        grown = radius + step * radius - radius
        difference = at(np.zeros(3), grown).volume - truth.volume
        assert float(difference / grown / radius**2) == pytest.approx(float(truth.area / radius**2), abs=2e-7)
        for axis in range(3):
            shift = step * radius * np.eye(3)[axis]
            moved = one.centers[0, axis] + shift[axis] - one.centers[0, axis]
            slope = float((at(shift, 0.0).volume - truth.volume) / moved / radius**2)
            assert slope == pytest.approx(float(truth.gradient[axis] / radius**2), abs=2e-7)


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


def test_a_mesh_of_the_same_surface_has_the_same_truth() -> None:
    _, pairs = frozen_class("tetrahedron", "random", 4)
    for row, truth in enumerate(true_overlaps(pairs)):
        radius, vertices = float(pairs.radii[row]), pairs.parameters[0][row]
        mesh = true_mesh_overlap(pairs.centers[row], radius, vertices, TETRAHEDRON_TRIANGLES)
        assert abs(mesh.volume - truth.volume) <= 1e-50


def box_below(gap: float) -> Pairs:
    """Return a sphere beyond a cube's edge in the direction (3/5, 4/5); at `gap` 0 it touches, exactly on the grid."""
    corner = np.array([0.0, 3.0, 4.0]) * (5.0 + gap)
    return Pairs("box", corner[None], np.array([25.0]), (-np.ones((1, 3)), np.eye(3)[None], np.ones((1, 3))))


def test_contact_sees_the_last_digit() -> None:
    assert not exact_contact(box_below(0.0), 0)
    assert exact_contact(box_below(-1e-15), 0)
    assert not exact_contact(box_below(1e-15), 0)
    larger = box_below(0.0)
    assert exact_contact(replace(larger, radii=np.nextafter(larger.radii, 26.0)), 0)
    # A contact has a volume, found without the decision beforehand.
    for name, pairs in frozen_classes(1, seed=3, solids=("tetrahedron",)).items():
        if "without volume" not in name:
            triangles = TETRAHEDRON_TRIANGLES
            mesh = true_mesh_overlap(pairs.centers[0], float(pairs.radii[0]), pairs.parameters[0][0], triangles)
            if abs(mesh.volume) > 1e-60 * pairs.sphere_volumes[0]:
                assert contacts(pairs)[0], name


def test_the_classes_are_frozen_and_those_on_the_grid_short_binary_numbers() -> None:
    first, again, other = frozen_classes(3), frozen_classes(3), frozen_classes(3, seed=1)
    for name, pairs in first.items():
        assert len(pairs) == 3
        assert all(map(np.array_equal, pairs.arguments, again[name].arguments)), name
        assert not np.array_equal(pairs.centers, other[name].centers), name
    for solid, kind in (("tetrahedron", "tangent vertex"), ("box", "tangent edge"), ("box", "centre on face")):
        for array in frozen_class(solid, kind, 50, grid=True)[1].arguments:
            assert np.array_equal(array * 32.0, np.round(array * 32.0)), kind


def test_counts_see_what_they_count() -> None:
    _, pairs = frozen_class("box", "random", 6, grid=True)
    spheres = pairs.sphere_volumes
    volumes = np.array([np.nan, -1e-3, 0.0, 0.5, 0.0, 2.0 * spheres[5]])
    found = count_failures(pairs, volumes, np.array([True, True, True, False, False, True]))
    assert (found.undefined, found.negative, found.false_zeros, found.false_positives) == (1, 1, 1, 1)
    assert found.largest_false_positive == pytest.approx(0.5 / spheres[3])
    assert found.excess >= 1.0
