"""The hard counts of `feelahead bench overlap` over a few thousand adversarial pairs: what must never happen."""

import numpy as np
import pytest
from rich.console import Console
from rich.progress import Progress

from feelahead.benchmarks.overlap.accuracy import Sample, depths, draw_samples
from feelahead.benchmarks.overlap.classes import frozen_classes
from feelahead.benchmarks.overlap.contact import contacts
from feelahead.benchmarks.overlap.pairs import Pairs
from feelahead.benchmarks.overlap.stress import (
    LARGE_ERROR,
    Counts,
    asymmetry,
    our_volumes,
    relabelled,
    shrinking,
    silent_nan,
)

EACH = 25
WORST = 1e-15
"""Of the sphere's volume."""


@pytest.fixture(scope="module")
def classes() -> dict[str, Pairs]:
    return frozen_classes(EACH, seed=7)


@pytest.fixture(scope="module")
def counts(classes: dict[str, Pairs]) -> Counts:
    found = Counts()
    for pairs in classes.values():
        volumes, exceptions = our_volumes(pairs)
        found.exceptions += exceptions
        found.add(pairs, volumes, contacts(pairs))
    found.examine_missed(Progress(console=Console(quiet=True)))
    return found


@pytest.fixture(scope="module")
def samples() -> list[Sample]:
    return draw_samples(frozen_classes(1, seed=8), Progress(console=Console(quiet=True)))


def test_no_exception_no_nan_and_nothing_negative(counts: Counts) -> None:
    assert counts.pairs > 4000
    assert (counts.exceptions, counts.nan, counts.negative) == (0, 0, 0)


def test_nothing_visible_is_returned_as_zero(counts: Counts) -> None:
    assert counts.largest_missed <= WORST


def test_no_overlap_is_returned_as_zero(counts: Counts) -> None:
    assert counts.false_zeros == 0


def test_spheres_apart_get_no_visible_volume(counts: Counts) -> None:
    assert counts.largest_false_positive <= WORST


def test_no_volume_exceeds_the_smaller_of_both(counts: Counts) -> None:
    assert counts.excess <= WORST


def test_no_error_is_large(samples: list[Sample]) -> None:
    worst = max((float(sample.errors(our_volumes(sample.pairs)[0]).max()), sample.name) for sample in samples)
    assert worst[0] <= LARGE_ERROR, worst[1]


def test_no_error_is_above_the_goal(samples: list[Sample]) -> None:
    worst = max((float(sample.errors(our_volumes(sample.pairs)[0]).max()), sample.name) for sample in samples)
    assert worst[0] <= WORST, worst[1]


def test_labels_do_not_matter(classes: dict[str, Pairs]) -> None:
    assert max(asymmetry(pairs, our_volumes(pairs)[0]) for pairs in classes.values()) <= WORST


def test_a_growing_sphere_does_not_lose_volume(classes: dict[str, Pairs]) -> None:
    assert max(shrinking(pairs, our_volumes(pairs)[0]) for pairs in classes.values()) <= WORST


def test_the_checked_functions_let_no_nan_pass() -> None:
    assert silent_nan(400, seed=9) == 0


def test_relabelled_solids_are_the_same_sets() -> None:
    for name in ("tetrahedron, random, general", "box, random, general"):
        pairs = frozen_classes(5)[name]
        original = np.sort(pairs.corners[:, :, 0], axis=1)
        for other in relabelled(pairs):
            assert not np.array_equal(other.corners, pairs.corners)
            np.testing.assert_allclose(np.sort(other.corners[:, :, 0], axis=1), original, atol=1e-14)


def test_counts_see_what_they_count() -> None:
    pairs = frozen_classes(6)["box, random, grid"]
    spheres = pairs.sphere_volumes
    volumes = np.array([np.nan, -1e-3, 0.0, 0.5, 0.0, 2.0 * spheres[5]])
    touching = np.array([True, True, True, False, False, True])
    counts = Counts()
    counts.add(pairs, volumes, touching)
    assert (counts.nan, counts.negative, counts.false_zeros, counts.false_positives) == (1, 1, 1, 1)
    assert counts.largest_false_positive == pytest.approx(0.5 / spheres[3])
    assert counts.excess >= 1.0


def test_depths_are_those_of_the_classes() -> None:
    classes = frozen_classes(20)
    for name, depth in (
        ("box, face depth 1e-3, grid", 2.0**-10),
        ("tetrahedron, vertex depth 1e-6, grid", 2.0**-20),
        ("half-space, depth 1e-3, general", 2.0**-10),
        ("sphere, tangent, grid", 0.0),
        ("box, centre on edge, grid", 1.0),
    ):
        pairs = classes[name]
        np.testing.assert_allclose(depths(pairs) / pairs.radii, depth, atol=1e-13)
