"""How pairs are grouped into blocks and lanes changes no result."""

from collections.abc import Callable

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.overlap import kernels
from robot_side.overlap.box_batch import overlap_boxes
from robot_side.overlap.lanes import LANES
from robot_side.overlap.solids.solid import Overlaps
from robot_side.overlap.tetrahedron_batch import overlap_tetrahedra

Arrays = tuple[FloatArray, ...]
Pairs = Callable[..., Overlaps]


def tetrahedra(count: int, seed: int = 0) -> Arrays:
    rng = np.random.default_rng(seed)
    radii = np.exp(rng.uniform(-1.5, 1.5, count))
    return rng.normal(size=(count, 3)), radii, rng.normal(size=(count, 4, 3))


def boxes(count: int, seed: int = 0) -> Arrays:
    rng = np.random.default_rng(seed)
    radii = np.exp(rng.uniform(-1.5, 1.5, count))
    turns = np.ascontiguousarray(np.linalg.qr(rng.normal(size=(count, 3, 3)))[0])
    return rng.normal(size=(count, 3)), radii, rng.normal(size=(count, 3)), turns, rng.uniform(0.2, 2.0, (count, 3))


KINDS = pytest.mark.parametrize(
    ("pairs", "make"),
    [(kernels.tetrahedron_pairs, tetrahedra), (kernels.box_pairs, boxes)],
    ids=["tetrahedra", "boxes"],
)


def assert_same(first: Overlaps, second: Overlaps) -> None:
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def left_by_bounds(arguments: Arrays) -> tuple[int, int]:
    """Return how many pairs the bounds leave to the lanes, and how many of these the lanes leave to precise forms."""
    total = len(arguments[1])
    rows = np.empty(total + 1, dtype=np.int64)
    overlap = overlap_tetrahedra if len(arguments) == 3 else overlap_boxes
    unsettled = overlap(*arguments, np.zeros(total), np.zeros((total, 3)), np.zeros(total), rows)
    return rows.item(-1), unsettled


@KINDS
@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
def test_a_pair_does_not_depend_on_its_neighbours(pairs: Pairs, make: Callable[[int], Arrays], count: int) -> None:
    arguments = make(count)
    tuple_type = pairs(*arguments)
    alone = [pairs(*(argument[i : i + 1] for argument in arguments)) for i in range(count)]
    assert [len(result) for result in tuple_type] == [count] * 3
    for result, parts in zip(tuple_type, zip(*alone, strict=True), strict=False):
        np.testing.assert_array_equal(result, np.concatenate(parts))


@KINDS
@pytest.mark.parametrize("count", [1, 8, 13, LANES, 3 * LANES + 5])
def test_blocks_in_which_all_pairs_are_cut_change_nothing(
    pairs: Pairs, make: Callable[[int], Arrays], count: int
) -> None:
    arguments = make(4000)
    mixed = pairs(*arguments)
    cut = np.flatnonzero((mixed[2] > 0.0) & (np.abs(mixed[1]).max(axis=1) > 0.1 * mixed[2]))[:count]
    alone = tuple(np.ascontiguousarray(argument[cut]) for argument in arguments)
    assert left_by_bounds(alone)[0] == count
    assert_same(pairs(*alone), (mixed[0][cut], mixed[1][cut], mixed[2][cut]))


@KINDS
def test_bounds_leave_pairs_whose_surfaces_cut_and_few_others(pairs: Pairs, make: Callable[[int], Arrays]) -> None:
    centers, radii, *solids = make(1000)
    assert left_by_bounds((centers + 100.0, radii, *solids)) == (0, 0)
    volumes, _, areas = pairs(centers, radii, *solids)
    cut = int(((volumes > 0.0) & (areas > 0.0) & (areas < 12.56 * radii**2)).sum())
    left, precise = left_by_bounds((centers, radii, *solids))
    assert cut <= left <= 1.2 * cut
    assert 0 <= precise <= 0.02 * cut
